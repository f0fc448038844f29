// The schedule that is drawn of a kernel's trace, judged by the trace file: both come of the same
// lines, by ways that share only the reading of a line.
#include "qduino/trace/traced_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "posix/small_file.h"
#include "qduino/trace/kernel_trace.h"

namespace qduino::apps::traced_picture_test {
namespace {

using picture::Doing;
using ::testing::HasSubstr;

// Loop 2 runs, is interrupted, is preempted by loop 1, goes on until its budget is spent, and wakes
// with a new one.
constexpr const char* kLines = R"(
 qduino-100     [000] .....    50.000000: sched_process_fork: comm=lamp pid=100 child_comm=lamp child_pid=301
 qduino-100     [000] .....    50.000001: sched_process_fork: comm=lamp pid=100 child_comm=lamp child_pid=302
 <idle>-0       [001] dN.2.    50.001000: sched_wakeup: comm=loop 2 pid=302 prio=20 target_cpu=001
 <idle>-0       [001] d..2.    50.001010: sched_switch: prev_comm=swapper/1 prev_pid=0 prev_prio=120 prev_state=R ==> next_comm=loop 2 next_pid=302 next_prio=20
 loop 2-302     [001] d.h..    50.001100: irq_handler_entry: irq=27 name=eth0-<rx>
 loop 2-302     [001] d.h..    50.001150: irq_handler_exit: irq=27 ret=handled
 loop 2-302     [001] dN.2.    50.002000: sched_wakeup: comm=loop 1 pid=301 prio=19 target_cpu=001
 loop 2-302     [001] d..2.    50.002004: sched_switch: prev_comm=loop 2 prev_pid=302 prev_prio=20 prev_state=R+ ==> next_comm=loop 1 next_pid=301 next_prio=19
 loop 1-301     [001] d..2.    50.002204: sched_switch: prev_comm=loop 1 prev_pid=301 prev_prio=19 prev_state=S ==> next_comm=loop 2 next_pid=302 next_prio=20
 loop 2-302     [001] .....    50.003500: signal_deliver: sig=37 errno=0 code=-2 sa_handler=7f00 sa_flags=14000004
 loop 2-302     [001] d..2.    50.003520: sched_switch: prev_comm=loop 2 prev_pid=302 prev_prio=20 prev_state=S ==> next_comm=swapper/1 next_pid=0 next_prio=120
 <idle>-0       [001] dN.2.    50.011000: sched_wakeup: comm=loop 2 pid=302 prio=20 target_cpu=001
 <idle>-0       [001] d..2.    50.011020: sched_switch: prev_comm=swapper/1 prev_pid=0 prev_prio=120 prev_state=R ==> next_comm=loop 2 next_pid=302 next_prio=20
 loop 2-302     [001] .....    50.011030: sys_enter: NR 15 (0, 0, 0, 0, 0, 0)
 loop 2-302     [001] d..2.    50.012000: sched_switch: prev_comm=loop 2 prev_pid=302 prev_prio=20 prev_state=S ==> next_comm=swapper/1 next_pid=0 next_prio=120
 <idle>-0       [001] dN.2.    50.021000: sched_wakeup: comm=loop 2 pid=302 prio=20 target_cpu=001
)";

using Told = std::vector<std::tuple<Doing, int, int>>;  // microseconds

class TracedPictureTest : public ::testing::Test {
  protected:
    void read(TracedWindow window, std::vector<AdmittedLoop> loops = {}) {
        picture_.emplace("lamp", std::move(loops), window);
        reader_.draw_into(*picture_);
        std::istringstream text(kLines);
        for (std::string line; std::getline(text, line);) reader_.line(line);
        schedule_ = picture_->finish();
    }
    const picture::Row& row(sched::VcpuId id) const {
        return *std::ranges::find(schedule_.cores.at(0).rows, id, &picture::Row::id);
    }
    Told told(sched::VcpuId id) const {
        Told out;
        for (const picture::Stretch& s : row(id).stretches)
            out.emplace_back(s.doing, static_cast<int>(to_ns(s.from) / 1000),
                             static_cast<int>(to_ns(s.until) / 1000));
        return out;
    }

    KernelTraceReader reader_{37, 100};
    std::optional<TracedPicture> picture_;
    picture::Schedule schedule_;
};

TEST_F(TracedPictureTest, TimeBeginsWithTheFirstStretch) {
    read({.from_s = 0, .length_s = 0.1});
    EXPECT_EQ(told(2), (Told{{Doing::runs, 0, 90},
                             {Doing::runs, 140, 994},
                             {Doing::waits, 994, 1194},
                             {Doing::runs, 1194, 2510},
                             {Doing::throttled, 2510, 9990},
                             {Doing::waits, 9990, 10010},
                             {Doing::runs, 10010, 10990}}));
    EXPECT_EQ(told(1), (Told{{Doing::waits, 990, 994}, {Doing::runs, 994, 1194}}));
    ASSERT_EQ(schedule_.cores.at(0).taken.size(), 1u);
    EXPECT_EQ(schedule_.cores[0].taken[0].what, "eth0-<rx>");
    EXPECT_EQ(schedule_.until, kEpoch + 19'990us) << "the last event";
}

TEST_F(TracedPictureTest, TheBarsAreAsLongAsTheStretchesOfTheTraceFile) {
    read({.from_s = 0, .length_s = 0.1});
    std::map<int, std::int64_t> in_file, drawn;
    for (const auto& event : nlohmann::json::parse(reader_.chrome_json())) {
        if (event["ph"] == "X") in_file[event["tid"]] += event["dur"].get<std::int64_t>();
    }
    for (const sched::VcpuId id : {1, 2}) {
        for (const auto& [doing, from, until] : told(id))
            drawn[id] += doing == Doing::runs ? until - from : 0;
    }
    constexpr int kInterrupts = 1000;
    EXPECT_EQ(drawn[1], in_file[1]);
    EXPECT_EQ(drawn[2] + in_file[kInterrupts], in_file[2]) << "an interrupt's time is not the loop's";
}

TEST_F(TracedPictureTest, AWakeUpFromThrottlingIsNoRelease) {
    read({.from_s = 0, .length_s = 0.1});
    ASSERT_EQ(row(2).releases.size(), 0u) << "the first came before its first stretch, the last at the end";
    EXPECT_EQ(row(1).releases.size(), 1u);
    EXPECT_FALSE(row(1).releases[0].due) << "the kernel knows no deadline";
}

TEST_F(TracedPictureTest, TheWindowIsThatOfTheLoops) {
    AdmittedLoop loop;
    loop.id = 2;
    loop.core = 1;
    loop.budget = 2ms;
    loop.period = 5ms;
    loop.response = 3ms;
    read({}, {loop});
    EXPECT_EQ(schedule_.until, kEpoch + 10ms) << "two periods";
    EXPECT_EQ(row(2).budget, 2ms);
    ASSERT_EQ(schedule_.responses.size(), 1u);
    EXPECT_EQ(schedule_.responses[0].worst, 3ms);
    EXPECT_FALSE(schedule_.responses[0].seen);
}

TEST(TracedPicture, NothingSeenIsAnError) {
    TracedPicture picture("lamp", {}, {});
    picture.woke(0, 1, 1000, false);
    picture.taken(0, 1000, 1010, "tick");
    const auto written = picture.write("/nonexistent/a.svg", nullptr);
    ASSERT_FALSE(written);
    EXPECT_THAT(std::string(written.error().message.view()), HasSubstr("saw no loop run"));
}

TEST(AdmittedLoops, AreThoseOfTheReport) {
    const std::string path =
        std::filesystem::temp_directory_path() / ("admitted-" + std::to_string(::getpid()));
    const auto loops_of = [&path](const char* text) {
        EXPECT_TRUE(posix::write_file(path, text));
        return admitted_loops(path);
    };
    const auto loops = loops_of(R"({"loops":[
        {"id":1,"core":0,"budget_ns":1000,"period_ns":2000,"response_ns":1500},
        {"id":2,"core":1,"budget_ns":2000,"period_ns":2000,"response_ns":null},
        {"id":3,"core":null,"budget_ns":2000,"period_ns":2000,"response_ns":null}],
        "io":[{"id":33,"core":0,"budget_ns":10,"period_ns":20}]})");
    ASSERT_EQ(loops.size(), 3u) << "one has no core";
    EXPECT_EQ(loops[0].response, 1500ns);
    EXPECT_FALSE(loops[1].response);
    EXPECT_TRUE(loops[2].is_io());
    for (const char* wrong : {"", "{}", "[]", R"({"loops":[{}],"io":[]})", R"({"loops":3,"io":[]})",
                              R"({"loops":[{"id":"a","core":0}],"io":[]})"})
        EXPECT_TRUE(loops_of(wrong).empty()) << wrong;
    std::filesystem::remove(path);
    EXPECT_TRUE(admitted_loops(path).empty());
}

}  // namespace
}  // namespace qduino::apps::traced_picture_test
