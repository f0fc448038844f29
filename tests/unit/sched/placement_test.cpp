#include "sched/placement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "tests/unit/sched/make.h"

namespace qduino::sched::placement_test {
namespace {

std::unique_ptr<MulticoreAdmission> admit_on(std::size_t cores, const std::vector<Vcpu>& requests) {
    const std::vector<PlatformOverheads> overheads(cores);
    auto result = std::make_unique<MulticoreAdmission>();
    admit_all(requests, overheads, {}, *result);
    return result;
}

TEST(Placement, ThePapersPrinterSketch) {
    const auto machine =
        admit_on(2, {loop_of(1, 30ms, 100ms, 0), loop_of(2, 100us, 100us, 1), loop_of(3, 1ms, 8ms, 0),
                     io_of(33, 1ms, 100ms, 0), io_of(34, 1ms, 100ms, 0)});
    EXPECT_TRUE(machine->admitted);
    EXPECT_EQ(machine->cores[0].by, AdmittedBy::bound);
    EXPECT_EQ(machine->cores[1].by, AdmittedBy::owned);
    EXPECT_EQ(machine->core_of(2), 1);
    EXPECT_EQ(machine->core_of(34), 0);
    EXPECT_EQ(machine->core_of(99), kAnyCore);
}

TEST(Placement, FirstFitFillsTheLowestCore) {
    const auto machine = admit_on(2, {loop_of(1, 2ms, 10ms, kAnyCore), loop_of(2, 3ms, 10ms, kAnyCore)});
    EXPECT_TRUE(machine->admitted);
    EXPECT_EQ(machine->core_of(1), 0);
    EXPECT_EQ(machine->core_of(2), 0);
}

TEST(Placement, WhatNamesItsCoreGoesFirst) {
    const auto machine = admit_on(2, {loop_of(1, 9ms, 10ms, kAnyCore), loop_of(2, 5ms, 10ms, 0)});
    EXPECT_TRUE(machine->admitted);
    EXPECT_EQ(machine->core_of(1), 1);
}

TEST(Placement, NothingGoesToAnOwnedCore) {
    const auto machine = admit_on(2, {loop_of(1, 100us, 100us, 0), loop_of(2, 1ms, 10ms, kAnyCore)});
    EXPECT_TRUE(machine->admitted);
    EXPECT_EQ(machine->core_of(2), 1);

    const auto refused = admit_on(1, {loop_of(1, 100us, 100us, 0), loop_of(2, 1ms, 10ms, kAnyCore)});
    EXPECT_FALSE(refused->admitted);
    EXPECT_EQ(refused->refusal.because, RefusedBecause::no_core_fits);
    EXPECT_EQ(refused->refusal.vcpu.id, 2);
}

TEST(Placement, NothingGoesWhereItIsKeptOff) {
    Vcpu io = io_of(33, 20ms, 100ms, kAnyCore);
    EXPECT_EQ(admit_on(3, {loop_of(1, 9ms, 10ms, 0), loop_of(2, 5ms, 10ms, 1), io})->core_of(33), 1);
    io.kept_off = 0b010;
    EXPECT_EQ(admit_on(3, {loop_of(1, 9ms, 10ms, 0), loop_of(2, 5ms, 10ms, 1), io})->core_of(33), 2);
    const auto refused = admit_on(2, {loop_of(1, 9ms, 10ms, 0), loop_of(2, 5ms, 10ms, 1), io});
    EXPECT_EQ(refused->refusal.because, RefusedBecause::no_core_fits);
    EXPECT_EQ(refused->refused_core, 0) << "and not core 1, which would need no change";
    io.core = 1;
    EXPECT_TRUE(admit_on(2, {loop_of(1, 9ms, 10ms, 0), loop_of(2, 5ms, 10ms, 1), io})->admitted)
        << "it names that core";
}

TEST(Placement, ARefusalNamesAnotherCoreThatWouldTakeIt) {
    const auto machine =
        admit_on(3, {loop_of(1, 30ms, 100ms, 0), loop_of(2, 20ms, 100ms, 0), loop_of(3, 4ms, 10ms, 0),
                     loop_of(4, 10001us, 100ms, 0), loop_of(5, 100us, 100us, 1)});
    EXPECT_FALSE(machine->admitted);
    EXPECT_EQ(machine->refused_core, 0);
    EXPECT_EQ(machine->refusal.vcpu.id, 4);
    ASSERT_TRUE(machine->refusal.remedy.other_core);
    EXPECT_EQ(*machine->refusal.remedy.other_core, 2);
    ASSERT_TRUE(machine->refusal.remedy.budget_less_by);
    EXPECT_EQ(*machine->refusal.remedy.budget_less_by, 1us);
}

TEST(Placement, WhenNoCoreFitsTheNearestIsNamed) {
    const auto machine =
        admit_on(2, {loop_of(1, 9ms, 10ms, 0), loop_of(2, 5ms, 10ms, 1), loop_of(3, 6ms, 10ms, kAnyCore)});
    EXPECT_FALSE(machine->admitted);
    EXPECT_EQ(machine->refusal.because, RefusedBecause::no_core_fits);
    EXPECT_EQ(machine->refusal.vcpu.id, 3);
    EXPECT_EQ(machine->refused_core, 1);
    ASSERT_TRUE(machine->refusal.remedy.budget_less_by);
    EXPECT_EQ(*machine->refusal.remedy.budget_less_by, 1ms);
    EXPECT_EQ(machine->core_of(3), kAnyCore);
}

TEST(Placement, RefusesWhatNoCoreCanLift) {
    EXPECT_EQ(admit_on(2, {loop_of(1, 1ms, 10ms, 2)})->refusal.because, RefusedBecause::no_such_core);
    EXPECT_EQ(admit_on(2, {loop_of(1, 1ms, 10ms, -2)})->refusal.because, RefusedBecause::no_such_core);
    EXPECT_EQ(admit_on(2, {loop_of(1, 0ms, 10ms)})->refusal.because, RefusedBecause::bad_parameters);
    EXPECT_EQ(admit_on(2, {loop_of(1, 1ms, 10ms, 0), loop_of(1, 1ms, 10ms, 1)})->refusal.because,
              RefusedBecause::duplicate_id);
}

TEST(Placement, TooManyForOneCore) {
    std::vector<Vcpu> requests;
    for (int i = 1; i <= 33; ++i) requests.push_back(loop_of(static_cast<VcpuId>(i), 1us, 1s, 0));
    const auto machine = admit_on(2, requests);
    EXPECT_EQ(machine->refusal.because, RefusedBecause::too_many);
    EXPECT_EQ(machine->refusal.vcpu.id, 33);
}

TEST(Placement, EachCoreHasItsOwnOverheads) {
    std::array<PlatformOverheads, 2> overheads;
    overheads[0].interferers.push_back(kernel_fair_server());
    const std::array<Vcpu, 1> requests{loop_of(1, 1ms, 8ms, kAnyCore)};
    const auto machine = std::make_unique<MulticoreAdmission>();
    admit_all(requests, overheads, {}, *machine);
    EXPECT_TRUE(machine->admitted);
    EXPECT_EQ(machine->core_of(1), 1);
}

/// Loops that fill one core to 95 % and are admitted there. Periods of 1 to 100 ms, log-uniform;
/// shares by Stafford's way for n parts of a sum (UUniFast: E. Bini, G. Buttazzo, 2005).
std::vector<Vcpu> loops_of_a_full_core(std::mt19937_64& random) {
    std::uniform_real_distribution<double> part{0, 1};
    for (;;) {
        const int count = 3 + static_cast<int>(random() % 6);
        CoreLoad load;
        double left = 0.95;
        for (int i = 0; i < count; ++i) {
            const double next = i + 1 < count ? left * std::pow(part(random), 1.0 / (count - 1 - i)) : 0;
            const auto period = static_cast<std::int64_t>(std::pow(10.0, 6 + 2 * part(random)));
            const auto budget = static_cast<std::int64_t>((left - next) * static_cast<double>(period));
            left = next;
            static_cast<void>(
                load.try_add({static_cast<VcpuId>(i + 1), Nanoseconds{std::max<std::int64_t>(budget, 1)},
                              Nanoseconds{period}, kAnyCore}));
        }
        if (is_admissible(load)) return {load.mains.begin(), load.mains.end()};
    }
}

TEST(Placement, RefusesFewOfTheSetsThatFit) {
    std::mt19937_64 random{20261123};
    int refused = 0;
    constexpr int kSets = 120;
    for (int set = 0; set < kSets; ++set) {
        const std::size_t cores = 2 + static_cast<std::size_t>(set) % 3;
        std::vector<Vcpu> all;
        for (std::size_t core = 0; core < cores; ++core) {
            for (const Vcpu& loop : loops_of_a_full_core(random)) all.push_back(loop);
        }
        std::shuffle(all.begin(), all.end(), random);
        for (std::size_t i = 0; i < all.size(); ++i) all[i].id = static_cast<VcpuId>(i + 1);
        refused += admit_on(cores, all)->admitted ? 0 : 1;
    }
    EXPECT_LE(refused, kSets / 20);
}

}  // namespace
}  // namespace qduino::sched::placement_test
