// Theory meets machine: random sets of loops that sched/ admits keep every period in the simulator,
// and those it refuses by completion time can be made to miss one. Seeds are printed with a
// failure.
#include <gtest/gtest.h>

#include <random>

#include "sched/admission.h"
#include "sim_fixture.h"

namespace qduino::board::sim::testing::sim_admission_test {
namespace {

struct TaskSet {
    sched::CoreLoad load;
    std::vector<Nanoseconds> offsets;  // of the first releases
};

class Generator {
  public:
    explicit Generator(std::uint64_t seed) : random_(seed) {}

    std::int64_t between(std::int64_t low, std::int64_t high) {
        return low + static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(high - low + 1));
    }
    /// Two to six loops, periods of 1 to 40 ms, between half and all of a core; with `io`, one I/O
    /// VCPU.
    TaskSet make(bool io) {
        TaskSet set;
        const std::int64_t n = between(2, 6);
        const std::int64_t fill_percent = between(50, 100);
        for (std::int64_t i = 0; i < n; ++i) {
            const Nanoseconds period = Nanoseconds{between(1000, 40'000) * 1000};
            const Nanoseconds budget =
                std::max(period * between(1, 2 * fill_percent) / (100 * n), Nanoseconds{10us});
            set.load.mains.push_back(
                {.id = static_cast<VcpuId>(i + 1), .budget = budget, .period = period, .core = 0});
            set.offsets.push_back(between(0, 1) * Nanoseconds{between(0, 20'000) * 1000});
        }
        if (io) {
            const Nanoseconds period = Nanoseconds{between(1000, 40'000) * 1000};
            set.load.ios.push_back({.id = 33,
                                    .budget = period * between(1, 15) / 100,
                                    .period = period,
                                    .core = 0,
                                    .kind = VcpuKind::io});
        }
        return set;
    }

  private:
    std::mt19937_64 random_;
};

struct Outcome {
    std::uint64_t releases = 0;
    std::uint64_t misses = 0;
    Nanoseconds worst_lateness = Nanoseconds::min();
};

/// Every loop takes its whole budget at each release; the I/O VCPU always has work, from `io_from`
/// on.
Outcome simulate(const TaskSet& set, Nanoseconds length, Nanoseconds io_from) {
    NoPeripherals wires;
    SimConfig config;
    config.cores = 1;
    if (!set.load.ios.empty()) {
        config.interrupts.push_back({.device = DeviceClass::nic,
                                     .rate_hz = 2000,
                                     .arrival = Arrival::periodic,
                                     .core = 0,
                                     .top_half = Nanoseconds{0},
                                     .bottom_half = 600us,
                                     .from = at(io_from)});
    }
    SimBoard board(config, wires);
    Program program;
    Outcome outcome;
    std::vector<Instant> due(set.load.mains.size());
    for (std::size_t i = 0; i < set.load.mains.size(); ++i) {
        const sched::Vcpu& request = set.load.mains[i];
        const auto [budget, period] = request.parameters();
        program.loop(request.id, budget, period, 0, [&, i, budget = budget, period = period] {
            for (Instant release = at(set.offsets[i]);; release += period) {
                due[i] = release + period;
                board.sleep_until(release);
                board.compute(budget);
                const Nanoseconds lateness = board.now() - due[i];
                outcome.worst_lateness = std::max(outcome.worst_lateness, lateness);
                outcome.misses += lateness > Nanoseconds{0};
                ++outcome.releases;
            }
        });
    }
    for (const sched::Vcpu& request : set.load.ios) {
        program.io(request.id, request.budget, request.period, 0);
        EXPECT_TRUE(board.serve_interrupts(DeviceClass::nic, request.id));
    }
    EXPECT_TRUE(board.start(program.specs()));
    board.run(at(length));
    // Starved: it never ended.
    for (const Instant instant : due) outcome.misses += instant < at(length);
    return outcome;
}

TEST(SimAdmission, AdmittedSetsOfLoopsKeepEveryPeriod) {
    int admitted = 0;
    for (std::uint64_t seed = 1; admitted < 300; ++seed) {
        ASSERT_LT(seed, 5000u);
        Generator generator(seed);
        const TaskSet set = generator.make(false);
        if (!sched::admit_without_remedy(set.load).admitted) continue;
        ++admitted;
        const Outcome outcome = simulate(set, 500ms, Nanoseconds{0});
        ASSERT_EQ(outcome.misses, 0u)
            << "seed " << seed << ", worst " << outcome.worst_lateness.count() << " ns";
        ASSERT_GT(outcome.releases, 10u);
    }
}

TEST(SimAdmission, AdmittedSetsWithAnIoVcpuKeepEveryPeriod) {
    int admitted = 0;
    for (std::uint64_t seed = 1; admitted < 300; ++seed) {
        ASSERT_LT(seed, 5000u);
        Generator generator(seed);
        const TaskSet set = generator.make(true);
        if (!sched::admit_without_remedy(set.load).admitted) continue;
        ++admitted;
        const Outcome outcome = simulate(set, 500ms, Nanoseconds{generator.between(0, 20'000) * 1000});
        ASSERT_EQ(outcome.misses, 0u)
            << "seed " << seed << ", worst " << outcome.worst_lateness.count() << " ns";
    }
}

TEST(SimAdmission, ASetRefusedByCompletionTimeMissesWhenAllAreReleasedAtOnce) {
    int refused = 0;
    for (std::uint64_t seed = 1; refused < 100; ++seed) {
        ASSERT_LT(seed, 5000u);
        Generator generator(seed);
        TaskSet set = generator.make(false);
        const sched::Admission admission = sched::admit_without_remedy(set.load);
        if (admission.refusal.because != sched::RefusedBecause::completion_time) continue;
        ++refused;
        // The critical instant: the test is exact.
        for (Nanoseconds& offset : set.offsets) offset = Nanoseconds{0};
        EXPECT_GT(simulate(set, 500ms, Nanoseconds{0}).misses, 0u) << "seed " << seed;
    }
}

TEST(SimAdmission, TheGoldenCaseMeetsItsPeriodsAndOneMoreMillisecondDoesNot) {
    TaskSet set;
    set.load.mains.push_back({.id = 1, .budget = 30ms, .period = 100ms, .core = 0});
    set.load.mains.push_back({.id = 2, .budget = 20ms, .period = 100ms, .core = 0});
    set.load.mains.push_back({.id = 3, .budget = 4ms, .period = 10ms, .core = 0});
    set.load.mains.push_back({.id = 4, .budget = 10ms, .period = 100ms, .core = 0});
    set.offsets.assign(4, Nanoseconds{0});
    EXPECT_TRUE(sched::admit_without_remedy(set.load).admitted);
    const Outcome just = simulate(set, 2s, Nanoseconds{0});
    EXPECT_EQ(just.misses, 0u);
    EXPECT_EQ(just.worst_lateness, Nanoseconds{0});  // R = 100 ms: to the nanosecond
    set.load.mains[3].budget += 1us;
    EXPECT_FALSE(sched::admit_without_remedy(set.load).admitted);
    EXPECT_GT(simulate(set, 2s, Nanoseconds{0}).misses, 0u);
}

}  // namespace
}  // namespace qduino::board::sim::testing::sim_admission_test
