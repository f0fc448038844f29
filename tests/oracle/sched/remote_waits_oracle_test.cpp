// Waits for locks of other cores, against a way to count them that takes one tick after the other
// and looks for groups of locks by walking from loop to loop.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <set>
#include <vector>

#include "sched/admission.h"
#include "sched/remote_blocking.h"
#include "tests/unit/sched/analyse.h"

namespace qduino::sched::oracle::remote_waits_oracle_test {
namespace {

constexpr int kCores = 3;

struct NaiveLoop {
    int core;
    std::int64_t budget, period;
    std::vector<std::pair<int, std::int64_t>> sections;  // lock, length
};
struct NaiveIo {
    int core;
    std::int64_t budget, period;
};
struct NaiveComputer {
    std::vector<NaiveLoop> loops;  // the id is the place + 1
    std::vector<NaiveIo> ios;
    std::int64_t activation = 0, further_wait = 0;
    std::array<std::int64_t, kCores> tick_cost{}, tick_interval{};
    std::vector<std::int64_t> ends_within;  // R of each loop, if it waits for nobody elsewhere
};

std::int64_t up(std::int64_t a, std::int64_t b) { return a <= 0 ? 0 : (a + b - 1) / b; }

class NaiveWaits {
  public:
    NaiveWaits(const NaiveComputer& computer, std::size_t i) : c_(computer), i_(i) { walk(i); }

    /// Some loop of the group is on another core.
    [[nodiscard]] bool crosses() const {
        return std::any_of(group_.begin(), group_.end(),
                           [&](std::size_t j) { return loop(j).core != loop(i_).core; });
    }
    /// The first tick by which nothing can keep the loop waiting; the period + 1: none.
    [[nodiscard]] std::int64_t longest() const {
        for (std::int64_t w = 1; w <= loop(i_).period; ++w) {
            std::int64_t sum = 0;
            for (int core = 0; core < kCores; ++core) sum += executed(core, w);
            if (sum + longest_first(kCores) < w) return w;
        }
        return loop(i_).period + 1;
    }
    [[nodiscard]] std::int64_t elsewhere(std::int64_t w) const {
        std::int64_t sum = 0;
        for (int core = 0; core < kCores; ++core) sum += core == loop(i_).core ? 0 : executed(core, w);
        return sum + longest_first(loop(i_).core);
    }
    [[nodiscard]] std::int64_t lifted() const {
        std::int64_t sum = 0;
        for (std::size_t j = 0; j < c_.loops.size(); ++j) {
            if (loop(j).core != loop(i_).core || !before(i_, j)) continue;
            const NaiveWaits its{c_, j};
            const bool for_somebody = std::any_of(its.group_.begin(), its.group_.end(), [&](std::size_t k) {
                return k != j && loop(k).period <= loop(i_).period;
            });
            if (its.crosses() && for_somebody) sum += locked(j);
        }
        return sum;
    }

  private:
    [[nodiscard]] const NaiveLoop& loop(std::size_t j) const { return c_.loops[j]; }
    [[nodiscard]] bool before(std::size_t a, std::size_t b) const {
        return std::pair{loop(a).period, a} < std::pair{loop(b).period, b};
    }
    void walk(std::size_t from) {
        if (!group_.insert(from).second) return;
        for (std::size_t j = 0; j < c_.loops.size(); ++j) {
            for (const auto& mine : loop(from).sections)
                for (const auto& its : loop(j).sections)
                    if (mine.first == its.first && mine.second > 0 && its.second > 0) walk(j);
        }
    }
    [[nodiscard]] bool crosses(std::size_t j) const {
        return j != i_ && (group_.count(j) > 0 || NaiveWaits{c_, j}.crosses());
    }
    [[nodiscard]] int requests(std::size_t j) const {
        return static_cast<int>(std::count_if(loop(j).sections.begin(), loop(j).sections.end(),
                                              [](const auto& each) { return each.second > 0; }));
    }
    [[nodiscard]] std::int64_t locked(std::size_t j) const {
        std::int64_t sum = 0;
        for (const auto& each : loop(j).sections) sum += each.second;
        return std::min(sum, loop(j).budget) + requests(j) * c_.further_wait;
    }
    [[nodiscard]] bool is_above(std::size_t j) const {
        return loop(j).core == loop(i_).core ? before(j, i_) : loop(j).period <= loop(i_).period;
    }
    [[nodiscard]] bool holds_first(std::size_t j) const {
        std::set<int> locks;
        for (const std::size_t k : group_) {
            for (const auto& each : loop(k).sections)
                if (each.second > 0) locks.insert(each.first);
        }
        return locks.size() == 1 && group_.count(j) > 0 && j != i_ && !is_above(j);
    }
    [[nodiscard]] std::int64_t longest_first(int but_core) const {
        std::int64_t longest = 0;
        for (std::size_t j = 0; j < c_.loops.size(); ++j) {
            if (loop(j).core != but_core && holds_first(j)) longest = std::max(longest, locked(j));
        }
        return longest;
    }
    [[nodiscard]] std::int64_t executed(int core, std::int64_t w) const {
        std::size_t lowest = i_;
        for (const std::size_t j : group_) {
            if (j != i_ && loop(j).core == core && (lowest == i_ || before(lowest, j))) lowest = j;
        }
        if (lowest == i_) return 0;  // no holder there
        std::int64_t sum = 0;
        for (std::size_t j = 0; j < c_.loops.size(); ++j) {
            if (j == i_ || loop(j).core != core || holds_first(j)) continue;
            const bool above = is_above(j);
            const std::int64_t whole = loop(j).budget + c_.activation + requests(j) * c_.further_wait;
            const std::int64_t each = above && before(j, lowest) ? whole : locked(j);
            const std::int64_t end = crosses(j) ? loop(j).period : c_.ends_within[j];
            sum += up(w + std::max<std::int64_t>(end - each, 0), loop(j).period) * each;
        }
        for (const NaiveIo& io : c_.ios) {
            if (io.core != core) continue;
            std::int64_t most = 0;
            for (const NaiveLoop& client : c_.loops) {
                if (client.core != core || client.period > loop(i_).period) continue;
                const std::int64_t each =
                    std::max(up(io.budget * client.period, io.period), c_.activation + 1);
                most = std::max(most, (2 + up(w - each, client.period)) * each);
            }
            sum += most;
        }
        const auto at = static_cast<std::size_t>(core);
        if (c_.tick_cost[at] > 0) sum += (up(w, c_.tick_interval[at]) + 1) * c_.tick_cost[at];
        return sum;
    }

    const NaiveComputer& c_;
    std::size_t i_;
    std::set<std::size_t> group_;
};

NaiveComputer random_computer(std::mt19937_64& random) {
    const auto pick = [&](std::int64_t low, std::int64_t high) {
        return std::uniform_int_distribution<std::int64_t>{low, high}(random);
    };
    NaiveComputer computer;
    for (std::int64_t n = pick(2, 7); n > 0; --n) {
        NaiveLoop loop{static_cast<int>(pick(0, kCores - 1)), 0, pick(20, 400), {}};
        loop.budget = pick(1, loop.period / 4 + 1);
        for (int lock = 0; lock < 4; ++lock) {
            if (pick(0, 2) == 0) loop.sections.emplace_back(lock, pick(0, loop.budget / 2));
        }
        computer.loops.push_back(loop);
    }
    for (std::int64_t n = pick(0, 2); n > 0; --n)
        computer.ios.push_back({static_cast<int>(pick(0, kCores - 1)), 1, pick(20, 60)});
    if (pick(0, 1) == 1) computer.activation = pick(0, 2), computer.further_wait = pick(0, 2);
    for (std::size_t core = 0; core < kCores; ++core)
        computer.tick_cost[core] = pick(0, 1), computer.tick_interval[core] = pick(10, 50);
    return computer;
}

std::vector<CoreLoad> loads_of(const NaiveComputer& computer) {
    std::vector<CoreLoad> loads(kCores);
    for (std::size_t core = 0; core < kCores; ++core) {
        CoreLoad& load = loads[core];
        load.core = static_cast<int>(core);
        load.overheads.release_cost = Nanoseconds{computer.activation};
        load.overheads.wait_cost = Nanoseconds{computer.further_wait};
        load.overheads.interferers.push_back({.name = "tick",
                                              .cost = Nanoseconds{computer.tick_cost[core]},
                                              .interval = Nanoseconds{computer.tick_interval[core]},
                                              .jitter = {}});
    }
    VcpuId id = 0;
    for (const NaiveLoop& loop : computer.loops) {
        ++id;
        CoreLoad& load = loads[static_cast<std::size_t>(loop.core)];
        load.mains.push_back({id, Nanoseconds{loop.budget}, Nanoseconds{loop.period}, loop.core});
        for (const auto& [lock, length] : loop.sections)
            load.sections.push_back({id, static_cast<std::uint8_t>(lock), Nanoseconds{length}});
    }
    id = 32;
    for (const NaiveIo& io : computer.ios)
        loads[static_cast<std::size_t>(io.core)].ios.push_back(
            {++id, Nanoseconds{io.budget}, Nanoseconds{io.period}, io.core, VcpuKind::io});
    return loads;
}

TEST(RemoteWaitsOracle, AreAsCountedTickByTick) {
    std::mt19937_64 random{8};
    int bounded = 0, endless = 0, lifted = 0, computers_that_cross = 0;
    for (int round = 0; round < 3000; ++round) {
        NaiveComputer computer = random_computer(random);
        std::vector<CoreLoad> loads = loads_of(computer);
        count_remote_waits(loads);
        // How R is found has an oracle of its own.
        for (std::size_t i = 0; i < computer.loops.size(); ++i) {
            const CoreLoad& load = loads[static_cast<std::size_t>(computer.loops[i].core)];
            const std::int64_t response = completion_time(load, static_cast<VcpuId>(i + 1)).response.count();
            computer.ends_within.push_back(std::min(response, computer.loops[i].period));
        }
        bool any = false;
        for (std::size_t i = 0; i < computer.loops.size(); ++i) {
            const NaiveLoop& loop = computer.loops[i];
            const NaiveWaits naive{computer, i};
            const auto& table = loads[static_cast<std::size_t>(loop.core)].waits;
            const auto* const found =
                std::ranges::find(table, static_cast<VcpuId>(i + 1), &RemoteWaits::loop);
            const RemoteWaits waits = found == table.end() ? RemoteWaits{} : *found;
            ASSERT_EQ(waits.requests > 0, naive.crosses()) << "round " << round << ", loop " << i + 1;
            ASSERT_EQ(waits.lifted.count(), naive.lifted()) << "round " << round << ", loop " << i + 1;
            lifted += waits.lifted.count() > 0 ? 1 : 0;
            if (!naive.crosses()) continue;
            any = true;
            const std::int64_t longest = naive.longest();
            ASSERT_EQ(waits.longest.count() > loop.period, longest > loop.period) << "round " << round;
            ++(longest > loop.period ? endless : bounded);
            if (longest > loop.period) continue;
            ASSERT_EQ(waits.longest.count(), longest) << "round " << round << ", loop " << i + 1;
            ASSERT_EQ(waits.each.count(), naive.elsewhere(longest)) << "round " << round;
        }
        ASSERT_EQ(any, locks_cross_cores(loads)) << "round " << round;
        computers_that_cross += any ? 1 : 0;
    }
    EXPECT_GT(bounded, 1000);
    EXPECT_GT(endless, 100);
    EXPECT_GT(lifted, 100);
    EXPECT_LT(computers_that_cross, 2900);
}

}  // namespace
}  // namespace qduino::sched::oracle::remote_waits_oracle_test
