// Random sketches in the simulator: with locks, sleeps, interrupts, bottom halves and routing. What
// was admitted keeps every period; of what was refused it is counted how many would have missed.
//
// The analysis has its own exhaustive model (tests/model/sched). Here the whole way is tried: the
// declarations of a sketch, the plan, and the simulator's servers, locks and costs.
//
//   QDUINO_RANDOM_SETS=10000   how many sketches (400 without it)
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <random>

#include "arduino/core/channels.h"
#include "arduino/core/interrupts.h"
#include "arduino/core/releases.h"
#include "arduino/core/timing.h"
#include "tests/scenario/guarantee/sketch_bench.h"

namespace qduino::guarantee::random_sets_test {
namespace {

using board::DeviceClass;

constexpr std::uint64_t kFirstSeed = 20261123;

/// What one loop does in a release, at most: compute, compute while it holds locks, sleep, compute.
struct RandomLoop {
    int core = 0;
    Nanoseconds period{}, before{}, outer{}, inner{}, sleep{}, after{};
    [[nodiscard]] Nanoseconds budget() const { return before + outer + inner + after; }
};

/// What a sketch does not tell admission.
enum class Lie { none, locks, sleeps, routing, other_cores };

class RandomSketch {
  public:
    explicit RandomSketch(std::uint64_t seed, Lie lie = Lie::none, int cores = 1)
        : random_(seed), lie_(lie), loops_(static_cast<std::size_t>(pick(cores == 1 ? 2 : 3, 4))) {
        std::array<double, 2> utilisation{};
        for (double& of_core : utilisation) of_core = (cores == 1 ? pick(55, 105) : pick(25, 95)) / 100.0;
        for (std::size_t i = 0; i < loops_.size(); ++i) {
            RandomLoop& loop = loops_[i];
            loop.core = cores == 1 || i == 0 ? 0 : i == 1 ? 1 : pick(0, 1);
            double& rest = utilisation.at(static_cast<std::size_t>(loop.core));
            const double part = i + 1 == loops_.size() ? rest : rest * pick(15, 70) / 100.0;
            rest -= part;
            fill(loop, part);
        }
        add_interrupts();
    }

    /// False: refused. It runs all the same when admission is not enforced.
    bool admitted(bool enforce) {
        for (std::size_t i = 0; i < loops_.size(); ++i) add(static_cast<VcpuId>(i + 1), loops_[i]);
        sketch_.set_setup([this] { set_up(); });
        const Result<void> begun = sketch_.begin(config_, {.enforce_admission = enforce});
        return begun && sketch_.runtime().plan().admitted();
    }
    /// A description of the first loop that missed a period; none when all were kept.
    std::optional<std::string> miss() {
        sketch_.run(40 * longest_);
        for (std::size_t i = 0; i < loops_.size(); ++i) {
            const runtime::LoopStatistics& seen = sketch_.statistics(static_cast<VcpuId>(i + 1));
            if (seen.overruns.get() == 0 && seen.releases.get() > 0) continue;
            return text<std::string>("loop ", i + 1, ": ", seen.overruns.get(), " of ", seen.releases.get(),
                                     " late, by up to ", Nanoseconds{seen.lateness_ns_max.get()});
        }
        return std::nullopt;
    }
    /// The sketch and what admission said of it, for a person.
    [[nodiscard]] std::string words() {
        std::string out{sketch_.runtime().explanation().view()};
        for (const RandomLoop& loop : loops_) {
            write(out, "core ", loop.core, ", every ", loop.period, ": computes ", loop.before, ", locked ",
                  loop.outer, ", nested ", loop.inner, ", sleeps ", loop.sleep, ", computes ", loop.after,
                  "\n");
        }
        write(out, "switch ", config_.costs.context_switch, ", tick ", config_.tick_cost, "\n");
        for (const board::sim::InterruptSource& source : config_.interrupts) {
            write(out, "interrupts on core ", source.core, " at ", Shortest{source.rate_hz},
                  " Hz: ", source.top_half, " + ", source.bottom_half, served_ ? ", served" : "", "\n");
        }
        return out;
    }

  private:
    int pick(int low, int high) { return std::uniform_int_distribution<int>{low, high}(random_); }
    bool one_in(int n) { return pick(1, n) == 1; }
    Nanoseconds part_of(Nanoseconds whole, int most_percent) { return whole * pick(0, most_percent) / 100; }

    void fill(RandomLoop& loop, double utilisation) {
        static constexpr std::array kPeriods{5, 8, 10, 12, 16, 20, 25, 40, 50, 100};
        loop.period = kPeriods.at(static_cast<std::size_t>(pick(0, 9))) * Nanoseconds{1ms};
        longest_ = std::max(longest_, loop.period);
        const auto budget = std::max(
            Nanoseconds{static_cast<std::int64_t>(utilisation * static_cast<double>(loop.period.count()))},
            Nanoseconds{100us});
        loop.before = part_of(budget, 50);
        if (!one_in(3)) loop.outer = part_of(budget - loop.before, 60);
        if (one_in(3)) loop.inner = part_of(budget - loop.before - loop.outer, 50);
        loop.after = budget - loop.before - loop.outer - loop.inner;
        if (one_in(3)) loop.sleep = part_of(std::max(loop.period - budget, Nanoseconds{0}), 60);
    }

    void add_interrupts() {
        config_.costs.context_switch = one_in(2) ? Nanoseconds{pick(1, 20) * 1us} : Nanoseconds{0};
        if (one_in(3)) config_.tick_period = 4ms, config_.tick_cost = pick(1, 30) * 1us;
        if (one_in(2)) return;
        const int core = pick(0, 1);
        config_.interrupts.push_back(
            {.device = DeviceClass::nic,
             .rate_hz = static_cast<double>(pick(50, 2000)),
             .arrival = one_in(2) ? board::sim::Arrival::periodic : board::sim::Arrival::poisson,
             .core = core,
             .top_half = pick(1, 60) * 1us,
             .bottom_half = pick(0, 150) * 1us});
        served_ = one_in(2);
        routed_ = core == 1;
    }
    void set_up() {
        for (std::size_t i = 0; i < loops_.size() && lie_ != Lie::locks; ++i) {
            const RandomLoop& loop = loops_[i];
            const auto id = static_cast<int>(i + 1);
            // A lie: another lock for the loops of the other core.
            const auto told = static_cast<std::size_t>(lie_ == Lie::other_cores ? loop.core : 0);
            if (loop.outer + loop.inner > Nanoseconds{0}) outer_.at(told).heldBy(id, loop.outer + loop.inner);
            if (loop.inner > Nanoseconds{0}) inner_.at(told).heldBy(id, loop.inner);
        }
        // A lock that nobody names would count as everybody's.
        for (Mutex& each : outer_) each.heldBy(32, 0ms);
        for (Mutex& each : inner_) each.heldBy(32, 0ms);
        if (served_) arduino::interrupts_vcpu(DeviceClass::nic, 1ms, 20ms, 0);
        if (routed_ && lie_ != Lie::routing) noInterrupts(DeviceClass::nic, 1);
    }

    void add(VcpuId id, const RandomLoop& loop) {
        sketch_.add_loop(
            id, loop.budget(), loop.period, loop.core, [this, &loop] { release(loop); },
            lie_ == Lie::sleeps ? Nanoseconds{0} : loop.sleep);
    }
    void release(const RandomLoop& loop) {
        if (routed_ && lie_ == Lie::routing)
            static_cast<void>(sketch_.board().route_interrupts(DeviceClass::nic, 1, false));
        if (one_in(20)) return waitForNextPeriod();
        compute(loop.before);
        if (loop.outer + loop.inner > Nanoseconds{0}) {
            outer_[0].lock();
            compute(loop.outer);
            if (loop.inner > Nanoseconds{0}) {
                inner_[0].lock();
                compute(loop.inner);
                inner_[0].unlock();
            }
            outer_[0].unlock();
        }
        if (loop.sleep > Nanoseconds{0})
            delayUntil(timeNow() + (one_in(2) ? loop.sleep : part_of(loop.sleep, 99)));
        compute(loop.after);
        waitForNextPeriod();
    }
    void compute(Nanoseconds most) { sketch_.board().compute(one_in(4) ? part_of(most, 100) : most); }

    std::mt19937_64 random_;
    Lie lie_;
    std::vector<RandomLoop> loops_;
    Nanoseconds longest_{};
    SimConfig config_;
    bool served_ = false, routed_ = false;
    std::array<Mutex, 2> outer_, inner_;  // the first ones are real
    SketchBench sketch_;
};

int number_of_sets() {
    const char* asked = std::getenv("QDUINO_RANDOM_SETS");
    return asked ? std::atoi(asked) : 400;
}

void hold_random_sets(int cores) {
    const int sets = number_of_sets();
    int admitted = 0, refused_and_missing = 0;
    for (int n = 0; n < sets; ++n) {
        const std::uint64_t seed = kFirstSeed + static_cast<std::uint64_t>(n);
        RandomSketch sketch{seed, Lie::none, cores};
        const bool fits = sketch.admitted(false);
        const std::optional<std::string> miss = sketch.miss();
        admitted += fits ? 1 : 0;
        refused_and_missing += !fits && miss ? 1 : 0;
        if (!fits) continue;
        EXPECT_EQ(miss, std::nullopt) << "seed " << seed << "\n" << sketch.words();
    }
    std::printf("%d sketches on %d cores: %d admitted, %d refused, %d of these seen to miss\n", sets, cores,
                admitted, sets - admitted, refused_and_missing);
    EXPECT_GT(admitted, sets / 10);
    EXPECT_GT(refused_and_missing, sets / 20);
}

TEST(RandomSets, WhatWasAdmittedKeepsEveryPeriod) { hold_random_sets(1); }

TEST(RandomSets, SoItDoesWithLocksBetweenTwoCores) { hold_random_sets(2); }

/// The mutants: admission that does not know of something.
TEST(RandomSets, WhatAdmissionIsNotToldOfMakesAdmittedLoopsMiss) {
    for (const Lie lie : {Lie::locks, Lie::sleeps, Lie::routing}) {
        int missing = 0;
        for (std::uint64_t seed = kFirstSeed; seed < kFirstSeed + 2000 && missing == 0; ++seed) {
            RandomSketch sketch{seed, lie};
            missing += sketch.admitted(false) && sketch.miss() ? 1 : 0;
        }
        EXPECT_GT(missing, 0) << static_cast<int>(lie);
    }
}

/// The mutant: two cores whose loops share locks, and an admission that judges each core alone. How
/// much more it admits that is not seen to miss is the price of the analysis.
TEST(RandomSets, AnAnalysisOfOneCoreAtATimeMakesAdmittedLoopsMiss) {
    const int sets = number_of_sets();
    int admitted = 0, missing = 0;
    for (std::uint64_t n = 0; n < static_cast<std::uint64_t>(sets); ++n) {
        RandomSketch sketch{kFirstSeed + n, Lie::other_cores, 2};
        if (!sketch.admitted(false)) continue;
        ++admitted;
        missing += sketch.miss() ? 1 : 0;
    }
    std::printf("%d sketches on 2 cores, each core judged alone: %d admitted, %d of these seen to miss\n",
                sets, admitted, missing);
    EXPECT_GT(missing, 0);
}

}  // namespace
}  // namespace qduino::guarantee::random_sets_test
