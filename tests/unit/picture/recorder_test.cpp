#include "report/picture/recorder.h"

#include <gtest/gtest.h>

#include "report/picture/ticks.h"

namespace qduino::apps::picture::recorder_test {
namespace {

using Told = std::vector<std::tuple<Doing, int, int>>;

constexpr Instant at(int ms) { return kEpoch + ms * 1ms; }

const Row& row(const Schedule& schedule, VcpuId id) {
    for (const Core& core : schedule.cores) {
        for (const Row& r : core.rows) {
            if (r.id == id) return r;
        }
    }
    throw std::out_of_range("no such row");
}

Told told(const Schedule& schedule, VcpuId id) {
    Told out;
    for (const Stretch& s : row(schedule, id).stretches)
        out.emplace_back(s.doing, static_cast<int>(to_ns(s.from) / 1'000'000),
                         static_cast<int>(to_ns(s.until) / 1'000'000));
    return out;
}

TEST(Recorder, AStretchEndsWhereTheNextBegins) {
    Recorder recorder(at(0), at(100));
    recorder.does(0, 1, Doing::runs, at(10));
    recorder.does(0, 2, Doing::waits, at(20));
    recorder.does(0, 2, Doing::runs, at(30));  // nobody said that loop 1 lost the core
    recorder.does(0, 2, Doing::throttled, at(50));
    recorder.does(0, 1, Doing::runs, at(50));
    recorder.does(0, 1, Doing::nothing, at(60));
    const Schedule schedule = recorder.finish(at(80));
    EXPECT_EQ(told(schedule, 1),
              (Told{{Doing::runs, 10, 30}, {Doing::waits, 30, 50}, {Doing::runs, 50, 60}}));
    EXPECT_EQ(told(schedule, 2),
              (Told{{Doing::waits, 20, 30}, {Doing::runs, 30, 50}, {Doing::throttled, 50, 80}}));
    EXPECT_EQ(schedule.until, at(80)) << "nothing is known of later";
}

TEST(Recorder, WhatIsTakenIsNotRun) {
    Recorder recorder(at(0), at(100));
    recorder.does(0, 1, Doing::runs, at(0), 50ms);
    recorder.taken(0, at(10), at(15), "nic");
    recorder.taken(0, at(15), at(20), "nic");
    recorder.taken(1, at(0), at(90), "tick");
    recorder.does(0, 1, Doing::nothing, at(30));
    const Schedule schedule = recorder.finish(at(100));
    EXPECT_EQ(told(schedule, 1), (Told{{Doing::runs, 0, 10}, {Doing::runs, 20, 30}}));
    EXPECT_EQ(row(schedule, 1).stretches.back().left_from, 40ms);
    EXPECT_EQ(row(schedule, 1).stretches.back().left_until, 30ms);
    ASSERT_EQ(schedule.cores.size(), 2u);
    EXPECT_TRUE(schedule.cores[1].rows.empty());
    EXPECT_EQ(schedule.cores[1].taken.size(), 1u) << "a core without loops shows what it takes";
    ASSERT_EQ(schedule.cores[0].taken.size(), 1u) << "two that touch are one";
    EXPECT_EQ(schedule.cores[0].taken[0].until, at(20));
}

TEST(Recorder, TheWindowCutsWhatLiesOutside) {
    Recorder recorder(at(100), at(200));
    recorder.does(0, 1, Doing::runs, at(50));
    recorder.released(0, 1, at(50), at(90));
    recorder.ended(1, at(80));
    recorder.does(0, 1, Doing::nothing, at(120));
    recorder.taken(0, at(90), at(101), "tick");
    recorder.released(0, 1, at(150), at(190));
    recorder.does(0, 1, Doing::runs, at(150));
    recorder.does(0, 1, Doing::nothing, at(250));
    recorder.ended_in_time(1);
    recorder.released(0, 1, at(300), at(340));
    recorder.ended(1, at(301));
    const Schedule schedule = recorder.finish(at(400));
    EXPECT_EQ(told(schedule, 1), (Told{{Doing::runs, 100, 120}, {Doing::runs, 150, 200}}));
    const Row& loop = row(schedule, 1);
    ASSERT_EQ(loop.releases.size(), 1u);
    EXPECT_EQ(loop.releases[0].done, at(250)) << "followed beyond the window";
    EXPECT_EQ(loop.releases[0].met, false);
    EXPECT_EQ(loop.worst_response, 100ms) << "of the whole run";
    EXPECT_EQ(schedule.cores[0].taken[0].from, at(100));
}

TEST(Recorder, AReleaseThatNobodySawEndIsInTimeWhenItsLoopSaysSo) {
    Recorder recorder(at(0), at(100));
    recorder.released(0, 1, at(0), at(10));
    recorder.does(0, 1, Doing::runs, at(0));
    recorder.ended_in_time(1);
    recorder.released(0, 1, at(10), at(20));
    const Schedule schedule = recorder.finish(at(100));
    EXPECT_EQ(row(schedule, 1).releases[0].met, true);
    EXPECT_FALSE(row(schedule, 1).releases[0].done);
    EXPECT_FALSE(row(schedule, 1).worst_response);
    EXPECT_FALSE(row(schedule, 1).releases[1].met) << "it has not ended";
}

TEST(Recorder, ItKeepsNoMoreThanItSays) {
    Recorder recorder(at(0), kForever);
    Instant now = at(0);
    for (std::size_t i = 0; i < Recorder::kStretchLimit; ++i) {
        recorder.does(0, 1, i % 2 == 0 ? Doing::runs : Doing::waits, now);
        now += 1us;
    }
    EXPECT_FALSE(recorder.cut());
    recorder.does(0, 1, Doing::runs, now);
    EXPECT_TRUE(recorder.cut());
    recorder.does(0, 1, Doing::nothing, now + 1s);
    const Schedule schedule = recorder.finish(now + 2s);
    EXPECT_EQ(schedule.until, now);
    EXPECT_EQ(row(schedule, 1).stretches.size(), Recorder::kStretchLimit);
}

TEST(Recorder, ARunThatEndedBeforeTheWindowLeavesNothing) {
    Recorder recorder(at(100), at(200));
    recorder.does(0, 1, Doing::runs, at(0));
    const Schedule schedule = recorder.finish(at(50));
    EXPECT_TRUE(row(schedule, 1).stretches.empty());
    EXPECT_GT(schedule.until, schedule.from);
}

TEST(GoodLength, ShowsTwoOfTheLongestPeriodsUnlessThatIsTooMany) {
    const auto length = [](std::initializer_list<Nanoseconds> periods) {
        std::vector<sched::Vcpu> vcpus;
        for (const Nanoseconds period : periods) vcpus.push_back({1, 1us, period, 0});
        return good_length(vcpus);
    };
    EXPECT_EQ(length({10ms, 100ms}), 200ms);
    EXPECT_EQ(length({1ms, 100ms}), 200ms);
    EXPECT_EQ(length({100us, 100ms}), 100ms);
    EXPECT_EQ(good_length({{1, 100us, 100us, 1}, {2, 1ms, 8ms, 0}}), 16ms) << "an owner's period says little";
    EXPECT_EQ(good_length({{1, 100us, 100us, 1}}), 2ms);
    EXPECT_EQ(good_length({}), 1s);
}

TEST(Ticks, StandAtRoundInstants) {
    EXPECT_EQ(tick_step(200ms, 11), 20ms);
    EXPECT_EQ(tick_step(199ms, 13), 20ms);
    EXPECT_EQ(tick_step(3600s, 13), 500s);
    EXPECT_EQ(tick_step(1ns, 2), 1ns);
    const auto found = ticks(at(95), at(200), 50ms);
    EXPECT_EQ(found, (std::vector<Instant>{at(100), at(150), at(200)}));
    EXPECT_EQ(tick_label(at(0), 50ms), "0");
    EXPECT_EQ(tick_label(at(150), 50ms), "150 ms");
    EXPECT_EQ(tick_label(at(1500), 500ms), "1.5 s");
    EXPECT_EQ(tick_label(at(2000), 1s), "2 s");
    EXPECT_EQ(tick_label(kEpoch + 1500us, 100us), "1.5 ms");
    EXPECT_EQ(tick_label(kEpoch + 120us, 20us), "120 us");
}

}  // namespace
}  // namespace qduino::apps::picture::recorder_test
