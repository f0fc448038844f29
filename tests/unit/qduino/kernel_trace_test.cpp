#include "qduino/trace/kernel_trace.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

namespace qduino::apps::kernel_trace_test {
namespace {

using nlohmann::json;

// As the kernel writes it: qduino (100) starts the supervisor (200), that the sketch (300), that
// two loops (301, 302). Loop 1 of another sketch (999) is somebody else's.
constexpr const char* kText = R"(# tracer: nop
#
# entries-in-buffer/entries-written: 23/30   #P:2
#
#           TASK-PID     CPU#  |||||  TIMESTAMP  FUNCTION
          qduino-100     [000] .....    50.000000: sched_process_fork: comm=qduino pid=100 child_comm=qduino child_pid=200
 qduino-supervis-200     [000] .....    50.000100: sched_process_fork: comm=qduino-supervis pid=200 child_comm=q child_pid=300
       lamp-linux-300     [000] .....    50.000200: sched_process_fork: comm=lamp-linux pid=300 child_comm=lamp-linux child_pid=301
       lamp-linux-300     [000] .....    50.000300: sched_process_fork: comm=lamp-linux pid=300 child_comm=lamp-linux child_pid=302
          <idle>-0       [001] dN.2.    50.001000: sched_wakeup: comm=loop 2 pid=302 prio=20 target_cpu=001
          <idle>-0       [001] d..2.    50.001010: sched_switch: prev_comm=swapper/1 prev_pid=0 prev_prio=120 prev_state=R ==> next_comm=loop 2 next_pid=302 next_prio=20
          loop 2-302     [001] d.h..    50.001100: irq_handler_entry: irq=27 name=virtio0-"rx"
          loop 2-302     [001] d.h..    50.001107: irq_handler_exit: irq=27 ret=handled
          loop 2-302     [001] dN.2.    50.002000: sched_wakeup: comm=loop 1 pid=301 prio=19 target_cpu=001
          loop 2-302     [001] d..2.    50.002004: sched_switch: prev_comm=loop 2 prev_pid=302 prev_prio=20 prev_state=R+ ==> next_comm=loop 1 next_pid=301 next_prio=19
          loop 1-301     [001] d..2.    50.002204: sched_switch: prev_comm=loop 1 prev_pid=301 prev_prio=19 prev_state=S ==> next_comm=loop 2 next_pid=302 next_prio=20
          loop 2-302     [001] .....    50.003000: signal_deliver: sig=37 errno=0 code=-2 sa_handler=7f00 sa_flags=14000004
          loop 2-302     [001] .....    50.003010: sys_enter: NR 15 (0, 0, 0, 0, 0, 0)
          loop 2-302     [001] .....    50.003500: signal_deliver: sig=37 errno=0 code=-2 sa_handler=7f00 sa_flags=14000004
          loop 2-302     [001] d..2.    50.003520: sched_switch: prev_comm=loop 2 prev_pid=302 prev_prio=20 prev_state=S ==> next_comm=loop 1 next_pid=999 next_prio=19
          loop 1-999     [001] d..2.    50.004000: sched_switch: prev_comm=loop 1 prev_pid=999 prev_prio=19 prev_state=S ==> next_comm=swapper/1 next_pid=0 next_prio=120
          <idle>-0       [000] d.h..    50.004000: local_timer_entry: vector=236
          <idle>-0       [000] d.h..    50.004010: local_timer_exit: vector=236
          <idle>-0       [001] d..2.    50.090000: sched_switch: prev_comm=swapper/1 prev_pid=0 prev_prio=120 prev_state=R ==> next_comm=loop 2 next_pid=302 next_prio=20
          loop 2-302     [001] .....    50.090010: sys_enter: NR 15 (0, 0, 0, 0, 0, 0)
          loop 2-302     [001] d..2.    50.090100: sched_switch: prev_comm=loop 2 prev_pid=302 prev_prio=20 prev_state=S ==> next_comm=swapper/1 next_pid=0 next_prio=120
          <idle>-0       [001] d..2.    50.100000: sched_switch: prev_comm=swapper/1 prev_pid=0 prev_prio=120 prev_state=R ==> next_comm=loop 1 next_pid=301 next_prio=19
          <idle>-0       [000] d.h..    50.100050: local_timer_entry: vector=236
)";

class KernelTraceTest : public ::testing::Test {
  protected:
    KernelTraceTest() {
        std::istringstream text(kText);
        for (std::string line; std::getline(text, line);) reader_.line(line);
        trace_ = json::parse(reader_.chrome_json());
    }
    std::vector<std::tuple<int, int, int>> stretches_of(const std::string& name) const {
        std::vector<std::tuple<int, int, int>> stretches;
        for (const json& event : trace_) {
            if (event["ph"] == "X" && event["name"] == name)
                stretches.emplace_back(event["pid"], event["ts"], event["dur"]);
        }
        return stretches;
    }
    std::vector<std::pair<int, int>> instants_of(const std::string& name) const {
        std::vector<std::pair<int, int>> instants;
        for (const json& event : trace_) {
            if (event["ph"] == "i" && event["name"] == name) instants.emplace_back(event["tid"], event["ts"]);
        }
        return instants;
    }
    using Stretches = std::vector<std::tuple<int, int, int>>;
    using Instants = std::vector<std::pair<int, int>>;

    KernelTraceReader reader_{37, 100};
    json trace_;
};

TEST_F(KernelTraceTest, StretchesOnACoreAreOurLoopsAlone) {
    EXPECT_EQ(stretches_of("loop 2"), (Stretches{{1, 1010, 994}, {1, 2204, 1316}, {1, 90000, 100}}));
    EXPECT_EQ(stretches_of("loop 1"), (Stretches{{1, 2004, 200}, {1, 100000, 50}}))
        << "the last one is cut off";
    EXPECT_EQ(reader_.stretches(), 5);
}

TEST_F(KernelTraceTest, WhyALoopLeftItsCoreIsTold) {
    EXPECT_EQ(instants_of("wake"), (Instants{{2, 1000}, {1, 2000}}));
    EXPECT_EQ(instants_of("preempt"), (Instants{{2, 2004}}));
    EXPECT_EQ(instants_of("block"), (Instants{{1, 2204}, {2, 90100}}));
    // The first shot was early, and returned; the second slept in its handler.
    EXPECT_EQ(instants_of("budget timer"), (Instants{{2, 3000}, {2, 3500}}));
    EXPECT_EQ(instants_of("throttle"), (Instants{{2, 3520}}));
}

TEST_F(KernelTraceTest, InterruptsAreThoseOfCoresThatLoopsRanOn) {
    EXPECT_EQ(stretches_of("interrupt"), (Stretches{{1, 1100, 7}}));
    for (const json& event : trace_) {
        EXPECT_EQ(event["pid"], 1);
        if (event["name"] == "interrupt") {
            EXPECT_EQ(event["args"]["device"], "virtio0-rx");
        }
    }
}

TEST_F(KernelTraceTest, WhatDidNotFitIsCounted) { EXPECT_EQ(reader_.lost(), 7); }

TEST(KernelTrace, AnythingElseIsPassedOver) {
    KernelTraceReader reader(37, 1);
    for (const char* line : {"", "#", "# entries-in-buffer/entries-written: ", "garbage", "x [", "x [1",
                             "x [000] ....", "[000] : :", "  a-1 [000] ..... 1.5: sched_switch:",
                             "  a-1 [000] ..... x: sched_switch: prev_comm=",
                             "  a-1 [000] ..... 1.5: sched_wakeup: comm=loop 1 pid=1",
                             "  a [000] ..... 1.5: signal_deliver: sig=37",
                             "  a-1 [999999999999] ..... 1.5: sched_switch: prev_comm=loop 1 prev_pid=1"}) {
        reader.line(line);
    }
    EXPECT_TRUE(json::parse(reader.chrome_json()).empty());
    EXPECT_EQ(reader.lost(), 0);
}

}  // namespace
}  // namespace qduino::apps::kernel_trace_test
