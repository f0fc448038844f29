// When one part of a sketch misbehaves, the others keep every period. Asserted from the loops'
// counters and from the trace, over a minute of virtual time.
//
//   loop 2   ██······██······██······██······        2 of every 8 ms, at its instants
//   loop 1     ██████  ██████  ██▒▒▒▒  ▒▒▒▒▒▒        runs away: its budget, never more
#include "arduino/core/interrupts.h"
#include "arduino/core/releases.h"
#include "arduino/core/timing.h"
#include "tests/scenario/guarantee/sketch_bench.h"

#include <random>

namespace qduino::guarantee::runaway_test {
namespace {

constexpr Nanoseconds kMinute = 60s;
constexpr Nanoseconds kVictimPeriod = 8ms;
constexpr std::int64_t kVictimReleases = kMinute / kVictimPeriod;

/// Ways to run away. Each is the whole of a loop's body, which never waits for its period as it
/// should.
enum class Runaway { one_endless_spin, short_spins, spins_and_naps };

struct Case {
    const char* name;
    Runaway way;
    Nanoseconds period;  ///< of the runaway; its budget is three tenths of it
};

class ARunaway : public ::testing::TestWithParam<Case> {
  protected:
    [[nodiscard]] Nanoseconds budget() const { return GetParam().period * 3 / 10; }

    SketchBench::Body runaway() {
        switch (GetParam().way) {
            case Runaway::one_endless_spin:
                return [] { delayBusyUntil(kForever); };
            case Runaway::short_spins:
                return [] { delayBusyMicroseconds(37); };
            case Runaway::spins_and_naps:  // to have budget saved up, and to be replenished early
                return [this] {
                    const auto draw = [this](Nanoseconds most) {
                        return Nanoseconds{static_cast<std::int64_t>(random_()) % most.count() + 1};
                    };
                    delayBusyUntil(timeNow() + draw(2 * budget()));
                    delayUntil(timeNow() + draw(GetParam().period));
                };
        }
        return {};
    }

    std::mt19937 random_{20170418};
    SketchBench sketch_;
};

TEST_P(ARunaway, TakesNotOnePeriodFromTheOtherLoop) {
    sketch_.add_loop(1, budget(), GetParam().period, 0, runaway());
    sketch_.add_loop(2, 2ms, kVictimPeriod, 0, [this] {
        sketch_.board().compute(2ms);
        waitForNextPeriod();
    });
    ASSERT_TRUE(sketch_.begin());
    sketch_.run(kMinute);

    const runtime::LoopStatistics& victim = sketch_.statistics(2);
    EXPECT_EQ(victim.passes.get(), kVictimReleases);
    EXPECT_EQ(victim.releases.get(), kVictimReleases);
    EXPECT_EQ(victim.overruns.get(), 0);
    EXPECT_EQ(victim.dropped.get(), 0);
    EXPECT_EQ(sketch_.board().cpu_time(2), kVictimReleases * Nanoseconds{2ms});
    EXPECT_EQ(sketch_.trace().count(TraceKind::release, 2), static_cast<std::size_t>(kVictimReleases));
    EXPECT_EQ(sketch_.trace().count(TraceKind::overrun, 2), 0u);
    EXPECT_EQ(sketch_.trace().count(TraceKind::throttle, 2), 0u);

    const Nanoseconds most = kMinute / GetParam().period * budget();
    EXPECT_LE(sketch_.board().cpu_time(1), most);
    if (GetParam().way != Runaway::spins_and_naps) {
        EXPECT_EQ(sketch_.board().cpu_time(1), most);
    }
}

TEST_P(ARunaway, GetsNoMoreThanItsBudgetInAnyWindowOfAPeriodAndOneMoreWhenItSleeps) {
    // Alone on its core: with nothing of higher rank to hold it up, no window may have more. One
    // that sleeps may use a budget late in a period, and the next one early: admission counts that.
    sketch_.add_loop(1, budget(), GetParam().period, 0, runaway());
    ASSERT_TRUE(sketch_.begin());
    sketch_.run(kMinute);
    const auto bursts = sketch_.trace().bursts(1);
    ASSERT_GT(bursts.size(), 100u);
    const Nanoseconds most = most_in_a_window(bursts, GetParam().period);
    if (GetParam().way == Runaway::spins_and_naps)
        EXPECT_LE(most, 2 * budget());
    else
        EXPECT_EQ(most, budget());
}

INSTANTIATE_TEST_SUITE_P(AboveAndBelow, ARunaway,
                         ::testing::Values(Case{"OneEndlessSpinAbove", Runaway::one_endless_spin, 4ms},
                                           Case{"OneEndlessSpinBelow", Runaway::one_endless_spin, 100ms},
                                           Case{"ShortSpinsAbove", Runaway::short_spins, 4ms},
                                           Case{"ShortSpinsBelow", Runaway::short_spins, 100ms},
                                           Case{"SpinsAndNapsAbove", Runaway::spins_and_naps, 4ms},
                                           Case{"SpinsAndNapsBelow", Runaway::spins_and_naps, 100ms}),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST(ARunawayHandler, IsKeptToTheBudgetOfItsIoVcpu) {
    // An output that is watched: the first edge begins a handler that never ends.
    SketchBench sketch;
    sketch.set_setup([] {
        ASSERT_TRUE(board::current().pin_mode(board::PinId{1}, board::PinMode::output).ok());
        ASSERT_TRUE(
            runtime::Runtime::current()
                ->attach_interrupt(
                    board::PinId{1}, board::Edge::rising, [] { delayBusyUntil(kForever); }, 1ms, 10ms, 0)
                .ok());
    });
    sketch.add_loop(1, 2ms, kVictimPeriod, 0, [&sketch] {
        board::current().pin_write(board::PinId{1}, board::Level::high);
        sketch.board().compute(2ms);
        waitForNextPeriod();
    });
    ASSERT_TRUE(sketch.begin());
    sketch.run(kMinute);
    EXPECT_EQ(sketch.statistics(1).passes.get(), kVictimReleases);
    EXPECT_EQ(sketch.statistics(1).overruns.get(), 0);
    const Nanoseconds handler = sketch.board().cpu_time(board::kFirstIoVcpu);
    EXPECT_GT(handler, Nanoseconds{5s});
    EXPECT_LE(handler, Nanoseconds{6s});  // a tenth
}

// ---- an overrun, by policy ----------------------------------------------------------------------

constexpr Nanoseconds kLateFrom = 1s;
constexpr Nanoseconds kLateUntil = 1200ms;

class AnOverrun : public ::testing::TestWithParam<OverrunPolicy> {
  protected:
    /// Loop 1 does 2 of its 3 ms in every 10 ms, but 13 ms more at each release for a fifth of a
    /// second.
    void run(Nanoseconds length) {
        told = 0;
        sketch_.set_setup([] {
            overrunPolicy(1, GetParam(), [](std::uint8_t id, std::chrono::nanoseconds lateness) {
                told += id == 1 && lateness > 0ns;
            });
        });
        sketch_.add_loop(1, 3ms, 10ms, 0, [this] {
            starts_.push_back(timeNow());
            sketch_.board().compute(2ms);
            waitForNextPeriod();
        });
        sketch_.add_loop(2, 8ms, 20ms, 0, [this] {
            sketch_.board().compute(8ms);
            waitForNextPeriod();
        });
        SimConfig config;
        config.loop_faults.push_back(
            {.loop = 1, .from = at(kLateFrom), .until = at(kLateUntil), .extra = 13ms});
        ASSERT_TRUE(sketch_.begin(config));
        sketch_.run(length);
    }

    static inline int told = 0;
    std::vector<Instant> starts_;
    SketchBench sketch_;
};

TEST_P(AnOverrun, IsTheLoopsOwnAffair) {
    run(10s);
    EXPECT_GT(sketch_.statistics(1).overruns.get(), 0);
    EXPECT_EQ(sketch_.statistics(2).overruns.get(), 0);
    EXPECT_EQ(told > 0, GetParam() == OverrunPolicy::call_back);
    if (GetParam() == OverrunPolicy::stop) {
        EXPECT_TRUE(sketch_.board().stopped());
        EXPECT_LT(sketch_.board().now(), at(kLateUntil));
        return;
    }
    EXPECT_EQ(sketch_.statistics(2).releases.get(), 500);
    // Its last second is on its grid again, every release of it.
    std::vector<Instant> last;
    for (const Instant start : starts_) {
        if (start >= at(9s)) last.push_back(start);
    }
    ASSERT_EQ(last.size(), 100u);
    for (std::size_t k = 0; k < last.size(); ++k)
        EXPECT_EQ(last[k], at(9s) + static_cast<std::int64_t>(k) * Nanoseconds{10ms});
    const bool runs_all = GetParam() == OverrunPolicy::catch_up;
    EXPECT_EQ(sketch_.statistics(1).dropped.get() == 0, runs_all);
    EXPECT_EQ(sketch_.statistics(1).passes.get() + sketch_.statistics(1).dropped.get(), 1000);
}

std::string name_of(const ::testing::TestParamInfo<OverrunPolicy>& tested) {
    constexpr std::array kNames{"Skip", "CatchUp", "KeepPhase", "CallBack", "Stop"};
    return kNames.at(static_cast<std::size_t>(tested.param));
}

INSTANTIATE_TEST_SUITE_P(ByPolicy, AnOverrun,
                         ::testing::Values(OverrunPolicy::skip, OverrunPolicy::catch_up,
                                           OverrunPolicy::keep_phase, OverrunPolicy::call_back,
                                           OverrunPolicy::stop),
                         name_of);

}  // namespace
}  // namespace qduino::guarantee::runaway_test
