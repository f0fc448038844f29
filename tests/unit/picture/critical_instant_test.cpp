// The worst schedule against the analysis, which does not play a schedule but solves an equation.
#include "report/picture/critical_instant.h"

#include <gtest/gtest.h>

#include <random>

#include "sched/admission.h"

namespace qduino::apps::picture::critical_instant_test {
namespace {

sched::CoreLoad random_load(std::mt19937& random, double utilisation) {
    sched::CoreLoad load;
    const int count = 2 + static_cast<int>(random() % 6);
    for (int i = 0; i < count; ++i) {
        constexpr std::int64_t kPeriodsMs[] = {5, 8, 10, 14, 20, 33, 50, 100};
        const Nanoseconds period = kPeriodsMs[random() % 8] * 1ms;
        const double share = utilisation / count * (0.5 + static_cast<double>(random() % 100) / 100.0);
        const Nanoseconds budget{static_cast<std::int64_t>(static_cast<double>(period.count()) * share)};
        load.mains.push_back({static_cast<VcpuId>(i + 1), budget, period, 0});
    }
    return load;
}

Schedule worst_of(const sched::CoreLoad& load, Instant until) {
    Recorder recorder(kEpoch, until);
    std::vector<sched::Vcpu> vcpus(load.mains.begin(), load.mains.end());
    vcpus.insert(vcpus.end(), load.ios.begin(), load.ios.end());
    record_critical_instant(vcpus, load.overheads, 0, until, recorder);
    return recorder.finish(until);
}

const Row& row_of(const Schedule& schedule, VcpuId id) {
    return *std::ranges::find(schedule.cores.front().rows, id, &Row::id);
}

Nanoseconds total(const Row& row, Doing doing) {
    Nanoseconds sum{0};
    for (const Stretch& s : row.stretches) sum += s.doing == doing ? s.until - s.from : Nanoseconds{0};
    return sum;
}

TEST(CriticalInstant, TheFirstEndOfEachLoopIsItsRWhereNothingElseIsCounted) {
    std::mt19937 random(17);
    int compared = 0;
    for (int i = 0; i < 300; ++i) {
        const sched::CoreLoad load = random_load(random, 0.7 + 0.02 * static_cast<double>(i % 20));
        const sched::Admission admission = sched::admit_without_remedy(load);
        const Schedule schedule = worst_of(load, kEpoch + 400ms);
        for (const sched::LoopResponse& loop : admission.loops) {
            const Row& row = row_of(schedule, loop.id);
            ASSERT_FALSE(row.releases.empty());
            const Release& first = row.releases.front();
            EXPECT_EQ(first.met.value_or(false), loop.meets()) << "set " << i << ", loop " << int{loop.id};
            if (!loop.meets()) continue;
            EXPECT_EQ(*first.done - first.at, loop.response) << "set " << i << ", loop " << int{loop.id};
            ++compared;
        }
    }
    EXPECT_GT(compared, 500);
}

TEST(CriticalInstant, WhatIsCountedBesideTheLoopsMakesNoFirstEndLaterThanR) {
    std::mt19937 random(23);
    for (int i = 0; i < 200; ++i) {
        sched::CoreLoad load = random_load(random, 0.5);
        load.overheads.release_cost = 20us;
        load.overheads.enforcement_cost = 10us;
        load.overheads.interferers.push_back({.name = "tick", .cost = 15us, .interval = 4ms, .jitter = 1ms});
        load.ios.push_back({33, 1ms, 20ms, 0, sched::VcpuKind::io});
        const sched::Admission admission = sched::admit_without_remedy(load);
        const Schedule schedule = worst_of(load, kEpoch + 200ms);
        EXPECT_FALSE(schedule.cores.front().taken.empty());
        for (const sched::LoopResponse& loop : admission.loops) {
            if (!loop.meets()) continue;
            const Release& first = row_of(schedule, loop.id).releases.front();
            ASSERT_TRUE(first.done) << "set " << i << ", loop " << int{loop.id};
            EXPECT_LE(*first.done - first.at, loop.response) << "set " << i << ", loop " << int{loop.id};
        }
    }
}

TEST(CriticalInstant, EachLoopRunsItsBudgetInEachPeriodAndNoMore) {
    sched::CoreLoad load;
    load.mains.push_back({1, 30ms, 100ms, 0});
    load.mains.push_back({2, 20ms, 100ms, 0});
    load.mains.push_back({3, 4ms, 10ms, 0});
    const Schedule schedule = worst_of(load, kEpoch + 200ms);
    EXPECT_EQ(total(row_of(schedule, 1), Doing::runs), 60ms);
    EXPECT_EQ(total(row_of(schedule, 2), Doing::runs), 40ms);
    EXPECT_EQ(total(row_of(schedule, 3), Doing::runs), 80ms);
    EXPECT_EQ(row_of(schedule, 2).worst_response, 86ms);  // the golden case of ARCHITECTURE.md
    EXPECT_EQ(schedule.cores.front().rows.front().id, 3) << "the highest priority stands first";
    for (const Row& row : schedule.cores.front().rows) EXPECT_EQ(total(row, Doing::throttled), 0ms);
}

TEST(CriticalInstant, ALoopThatNeverGetsThroughMissesEachDeadline) {
    sched::CoreLoad load;
    load.mains.push_back({1, 9ms, 10ms, 0});
    load.mains.push_back({2, 20ms, 40ms, 0});
    const Schedule schedule = worst_of(load, kEpoch + 160ms);
    int missed = 0;
    for (const Release& release : row_of(schedule, 2).releases) missed += release.met == std::optional(false);
    EXPECT_EQ(missed, 4);
}

TEST(CriticalInstant, WhatNoSchedulerWouldTakeIsLeftOut) {
    sched::CoreLoad load;
    load.mains.push_back({1, 20ms, 10ms, 0});
    EXPECT_TRUE(worst_of(load, kEpoch + 100ms).cores.empty());
}

}  // namespace
}  // namespace qduino::apps::picture::critical_instant_test
