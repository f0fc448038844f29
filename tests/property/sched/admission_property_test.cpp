// Admission keeps its promise: in a simulation with the real scheduler, every loop of every
// admitted set gets its budget in every period, whatever the I/O VCPUs do. And a runaway loop harms
// no other.

#include <gtest/gtest.h>

#include <algorithm>
#include <queue>
#include <random>
#include <string>
#include <vector>

#include "sched/admission.h"
#include "sched/core_scheduler.h"

namespace qduino::sched::admission_property_test {
namespace {

enum class IoPattern { saturating, random_bursts };

/// One core, its loops released with random offsets and gaps, its I/O VCPUs fed with work for
/// random clients.
class CoreRun {
  public:
    CoreRun(const CoreLoad& load, std::uint64_t seed, IoPattern pattern, bool synchronous)
        : load_(load), random_(seed), pattern_(pattern), synchronous_(synchronous) {
        for (const Vcpu& main : load.mains) {
            EXPECT_TRUE(core_.add(main.id, main.parameters()));
            jobs_.push_back({main.id, synchronous ? 0 : pick(0, main.period.count())});
        }
        for (const Vcpu& io : load.ios) {
            EXPECT_TRUE(core_.add_io(io.id, io.parameters()));
            jobs_.push_back({io.id, synchronous ? 0 : pick(0, io.period.count())});
        }
    }

    /// The first missed period up to `end`, in words; empty when there is none.
    std::string first_miss(std::int64_t end) {
        while (now_ < end) {
            for (Job& job : jobs_) {
                if (job.next_release == now_) release(job);
            }
            if (!missed_.empty()) return missed_;
            const Decision decision = core_.decide(instant_from_ns(now_));
            std::int64_t until = std::min(end, to_ns(decision.until));
            for (const Job& job : jobs_) until = std::min(until, job.next_release);
            Job* job = decision.vcpu ? &job_of(*decision.vcpu) : nullptr;
            if (job) until = std::min(until, now_ + job->left);
            if (until <= now_) return "no progress at " + std::to_string(now_);
            if (job) run(*job, until);
            if (!decision.vcpu) idled_ += until - now_;
            now_ = until;
        }
        core_.account(instant_from_ns(now_));
        return missed_;
    }
    [[nodiscard]] std::int64_t idled() const { return idled_; }
    [[nodiscard]] const CoreScheduler& core() const { return core_; }

  private:
    struct Job {
        VcpuId id;
        std::int64_t next_release;
        std::int64_t left = 0;
        std::int64_t deadline = 0;
    };
    std::int64_t pick(std::int64_t low, std::int64_t high) {
        return std::uniform_int_distribution<std::int64_t>{low, high}(random_);
    }
    Job& job_of(VcpuId id) {
        return *std::find_if(jobs_.begin(), jobs_.end(), [id](const Job& job) { return job.id == id; });
    }
    void release(Job& job) {
        if (core_.server(job.id).is_io()) return release_io(job);
        const VcpuParameters& parameters = core_.server(job.id).parameters();
        if (job.left > 0) {
            missed_ = "loop " + std::to_string(job.id) + " missed its period at " + std::to_string(now_);
            return;
        }
        job.left = parameters.budget.count();
        if (!synchronous_ && pick(0, 3) == 0) job.left = pick(1, job.left);
        job.deadline = now_ + parameters.period.count();
        job.next_release = job.deadline;
        core_.wake(job.id, instant_from_ns(now_));
    }
    void release_io(Job& job) {
        const VcpuParameters& own = core_.server(job.id).parameters();
        const std::size_t client =
            static_cast<std::size_t>(pick(0, static_cast<std::int64_t>(load_.mains.size()) - 1));
        const Nanoseconds period = load_.mains[client].period;
        const std::int64_t share = std::max<std::int64_t>(1, own.budget * period.count() / own.period);
        job.left += pattern_ == IoPattern::saturating ? 4 * share : pick(1, share);
        job.next_release =
            now_ + pick(1, pattern_ == IoPattern::saturating ? period.count() : 2 * period.count());
        core_.wake_io(job.id, instant_from_ns(now_), period);
    }
    void run(Job& job, std::int64_t until) {
        job.left -= until - now_;
        if (job.left == 0) core_.block(job.id, instant_from_ns(until));
    }

    CoreLoad load_;
    std::mt19937_64 random_;
    IoPattern pattern_;
    bool synchronous_;
    CoreScheduler core_;
    std::vector<Job> jobs_;
    std::string missed_;
    std::int64_t now_ = 0;
    std::int64_t idled_ = 0;
};

/// Sets of about `fill` utilisation, so that many are near what can be admitted.
CoreLoad random_load(std::uint64_t seed, int most_ios) {
    std::mt19937_64 random{seed};
    const auto pick = [&](std::int64_t low, std::int64_t high) {
        return std::uniform_int_distribution<std::int64_t>{low, high}(random);
    };
    CoreLoad load;
    const std::int64_t count = pick(1, 6);
    for (std::int64_t i = 1; i <= count; ++i) {
        const std::int64_t period = pick(20, 400);
        const std::int64_t budget =
            std::clamp<std::int64_t>(period * pick(30, 160) / (100 * count), 1, period);
        load.mains.push_back({static_cast<VcpuId>(i), Nanoseconds{budget}, Nanoseconds{period}, kAnyCore});
    }
    for (std::int64_t k = pick(0, most_ios); k > 0; --k) {
        load.ios.push_back({static_cast<VcpuId>(32 + k), Nanoseconds{pick(1, 5)}, Nanoseconds{pick(30, 120)},
                            kAnyCore, VcpuKind::io});
    }
    return load;
}

std::string miss_of(const CoreLoad& load, std::uint64_t seed, std::int64_t end = 20'000) {
    for (const IoPattern pattern : {IoPattern::saturating, IoPattern::random_bursts}) {
        for (const bool synchronous : {true, false}) {
            const std::string miss = CoreRun{load, seed, pattern, synchronous}.first_miss(end);
            if (!miss.empty()) return miss;
        }
    }
    return {};
}

TEST(AdmissionProperty, EveryAdmittedSetOfLoopsMeetsItsPeriods) {
    int by_bound = 0;
    int by_completion_time = 0;
    for (std::uint64_t seed = 1; seed <= 1500; ++seed) {
        const CoreLoad load = random_load(seed, 0);
        if (!is_admissible(load)) continue;
        ++(admitted_by_bound(load) ? by_bound : by_completion_time);
        ASSERT_EQ(miss_of(load, seed), "") << "seed " << seed;
    }
    EXPECT_GT(by_bound, 100);
    EXPECT_GT(by_completion_time, 50);
}

TEST(AdmissionProperty, EveryAdmittedSetWithIoVcpusMeetsItsPeriods) {
    int by_bound = 0;
    int by_completion_time = 0;
    for (std::uint64_t seed = 1; seed <= 2500; ++seed) {
        const CoreLoad load = random_load(seed, 3);
        if (load.ios.empty() || !is_admissible(load)) continue;
        ++(admitted_by_bound(load) ? by_bound : by_completion_time);
        ASSERT_EQ(miss_of(load, seed), "") << "seed " << seed;
    }
    EXPECT_GT(by_bound, 100);
    EXPECT_GT(by_completion_time, 50);
}

/// Without I/O VCPUs the analysis is exact: what completion time refuses does miss when all loops
/// start together.
TEST(AdmissionProperty, EveryRefusedSetOfLoopsMisses) {
    int refused = 0;
    for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
        const CoreLoad load = random_load(seed, 0);
        if (is_admissible(load)) continue;
        ++refused;
        EXPECT_NE((CoreRun{load, seed, IoPattern::saturating, true}.first_miss(20'000)), "")
            << "seed " << seed;
    }
    EXPECT_GT(refused, 100);
}

/// A wrong analysis must be seen: sets that fit only if one forgets their I/O VCPUs.
TEST(AdmissionProperty, CatchesAnAnalysisThatForgetsIo) {
    int tried = 0;
    int missed = 0;
    for (std::uint64_t seed = 1; seed <= 2500; ++seed) {
        const CoreLoad load = random_load(seed, 3);
        CoreLoad forgotten = load;
        forgotten.ios.clear();
        if (is_admissible(load) || !is_admissible(forgotten)) continue;
        ++tried;
        missed += miss_of(load, seed).empty() ? 0 : 1;
    }
    EXPECT_GT(tried, 100);
    EXPECT_GT(missed, tried / 10);
}

/// Every nanosecond is somebody's: charges and idle time add up to the time that passed.
TEST(AdmissionProperty, TimeIsConserved) {
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
        const CoreLoad load = random_load(seed, 3);
        if (!is_admissible(load)) continue;
        CoreRun run{load, seed, IoPattern::random_bursts, false};
        ASSERT_EQ(run.first_miss(20'000), "");
        Nanoseconds sum{run.idled()};
        for (const Vcpu& main : load.mains) sum += run.core().consumed(main.id);
        for (const Vcpu& io : load.ios) sum += run.core().consumed(io.id);
        ASSERT_EQ(sum, 20'000ns) << "seed " << seed;
    }
}

/// Two loops on one core, the one of higher priority runs away for ever: the other keeps every
/// period for 60 s.
TEST(AdmissionProperty, ARunawayLoopHarmsNobody) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {2ms, 8ms}));
    ASSERT_TRUE(core.add(2, {60ms, 100ms}));
    ASSERT_TRUE(is_admissible([] {
        CoreLoad load;
        load.mains.push_back({1, 2ms, 8ms, 0});
        load.mains.push_back({2, 60ms, 100ms, 0});
        return load;
    }()));
    core.wake(1, kEpoch);
    Instant now = kEpoch;
    for (int k = 0; k < 600; ++k) {
        const Instant release = kEpoch + k * 100ms;
        core.wake(2, release);
        Nanoseconds left = 60ms;
        while (now < release + 100ms) {
            const Decision decision = core.decide(now);
            const bool victim = decision.vcpu == VcpuId{2};
            Instant until = std::min(decision.until, release + 100ms);
            if (victim) until = std::min(until, now + left);
            if (victim) left -= until - now;
            now = until;
            if (victim && left == 0ns) core.block(2, now);
        }
        ASSERT_EQ(left, 0ns) << "period " << k;
    }
    EXPECT_EQ(core.consumed(2), 600 * 60ms);
    EXPECT_EQ(core.consumed(1), 60s / 4);
}

}  // namespace
}  // namespace qduino::sched::admission_property_test
