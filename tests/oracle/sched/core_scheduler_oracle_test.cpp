// The event-driven scheduler against the one that steps one tick at a time: the same arrivals, the
// same schedule.

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "sched/core_scheduler.h"
#include "tests/oracle/sched/tick_scheduler.h"

namespace qduino::sched::oracle::core_scheduler_oracle_test {
namespace {

struct Arrival {
    std::int64_t at;
    int id;
    std::int64_t work;
    std::int64_t client_period;
};

struct Vcpu {
    int id;
    bool io;
    std::int64_t budget;
    std::int64_t period;
};

struct Scenario {
    std::vector<Vcpu> vcpus;
    std::vector<Arrival> arrivals;
    std::int64_t end = 0;
};

Scenario random_scenario(std::uint64_t seed) {
    std::mt19937_64 random{seed};
    const auto pick = [&](std::int64_t low, std::int64_t high) {
        return std::uniform_int_distribution<std::int64_t>{low, high}(random);
    };
    Scenario scenario;
    scenario.end = 4000;
    const int mains = static_cast<int>(pick(1, 4));
    const int ios = static_cast<int>(pick(0, 3));
    for (int i = 0; i < mains + ios; ++i) {
        // Small budgets: with 8 tokens the 16 refills never run out, and the token list is matched
        // exactly.
        const std::int64_t budget = pick(1, 8);
        const bool io = i >= mains;
        scenario.vcpus.push_back({io ? 33 + i - mains : 1 + i, io, budget, budget + pick(0, 60)});
    }
    for (std::int64_t t = 0; t < scenario.end; t += pick(0, 25)) {
        const Vcpu& vcpu = scenario.vcpus[static_cast<std::size_t>(pick(0, mains + ios - 1))];
        scenario.arrivals.push_back({t, vcpu.id, pick(1, 12), pick(10, 100)});
    }
    return scenario;
}

std::vector<int> tick_by_tick(const Scenario& scenario) {
    TickScheduler core;
    for (const Vcpu& vcpu : scenario.vcpus) core.add(vcpu.id, vcpu.io, vcpu.budget, vcpu.period);
    std::vector<int> schedule;
    std::size_t next = 0;
    for (std::int64_t now = 0; now < scenario.end; ++now) {
        for (; next < scenario.arrivals.size() && scenario.arrivals[next].at == now; ++next) {
            const Arrival& arrival = scenario.arrivals[next];
            core.arrive(arrival.id, now, arrival.work, arrival.client_period);
        }
        schedule.push_back(core.tick(now));
    }
    return schedule;
}

/// The same through CoreScheduler, jumping from event to event.
class EventDriven {
  public:
    explicit EventDriven(const Scenario& scenario) : scenario_(scenario), work_(256) {
        for (const Vcpu& v : scenario.vcpus) {
            const VcpuParameters parameters{Nanoseconds{v.budget}, Nanoseconds{v.period}};
            const VcpuId id = static_cast<VcpuId>(v.id);
            EXPECT_TRUE(v.io ? core_.add_io(id, parameters) : core_.add(id, parameters));
        }
    }
    std::vector<int> run() {
        while (now_ < scenario_.end) {
            arrivals();
            const Decision decision = core_.decide(instant_from_ns(now_));
            std::int64_t until = std::min(scenario_.end, to_ns(decision.until));
            if (next_ < scenario_.arrivals.size()) until = std::min(until, scenario_.arrivals[next_].at);
            if (decision.vcpu) until = std::min(until, now_ + work_[*decision.vcpu]);
            EXPECT_GT(until, now_) << "a decision that ends at once makes no progress";
            if (until <= now_) return {};
            schedule_.insert(schedule_.end(), static_cast<std::size_t>(until - now_),
                             decision.vcpu.value_or(0));
            if (decision.vcpu) finish(*decision.vcpu, until);
            now_ = until;
        }
        return schedule_;
    }
    CoreScheduler& core() { return core_; }

  private:
    void arrivals() {
        for (; next_ < scenario_.arrivals.size() && scenario_.arrivals[next_].at == now_; ++next_) {
            const Arrival& arrival = scenario_.arrivals[next_];
            const VcpuId id = static_cast<VcpuId>(arrival.id);
            work_[id] += arrival.work;
            if (core_.server(id).is_io()) {
                core_.wake_io(id, instant_from_ns(now_), Nanoseconds{arrival.client_period});
            } else {
                core_.wake(id, instant_from_ns(now_));
            }
        }
    }
    void finish(VcpuId id, std::int64_t until) {
        work_[id] -= until - now_;
        if (work_[id] == 0) core_.block(id, instant_from_ns(until));
    }

    const Scenario& scenario_;
    CoreScheduler core_;
    std::vector<std::int64_t> work_;
    std::vector<int> schedule_;
    std::int64_t now_ = 0;
    std::size_t next_ = 0;
};

TEST(CoreSchedulerOracle, SameScheduleAsTickByTick) {
    for (std::uint64_t seed = 1; seed <= 600; ++seed) {
        const Scenario scenario = random_scenario(seed);
        const std::vector<int> expected = tick_by_tick(scenario);
        const std::vector<int> actual = EventDriven{scenario}.run();
        ASSERT_EQ(actual.size(), expected.size()) << "seed " << seed;
        for (std::size_t t = 0; t < expected.size(); ++t) {
            ASSERT_EQ(actual[t], expected[t]) << "seed " << seed << ", tick " << t;
        }
    }
}

TEST(CoreSchedulerOracle, EveryTickIsChargedOnceToWhomItRan) {
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
        const Scenario scenario = random_scenario(seed);
        EventDriven driver{scenario};
        const std::vector<int> schedule = driver.run();
        driver.core().account(instant_from_ns(scenario.end));
        for (const Vcpu& vcpu : scenario.vcpus) {
            const auto ran = std::count(schedule.begin(), schedule.end(), vcpu.id);
            ASSERT_EQ(driver.core().consumed(static_cast<VcpuId>(vcpu.id)), Nanoseconds{ran})
                << "seed " << seed;
        }
    }
}

}  // namespace
}  // namespace qduino::sched::oracle::core_scheduler_oracle_test
