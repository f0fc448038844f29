// What is drawn of a run, judged by the simulator's own accounts: the CPU time that it charged to
// each VCPU, the time that was taken of each core, the overruns that each loop counted. The judge
// reads the page itself: the widths of its bars.
//
// The mutants are sinks between the simulator and the recorder that tell it something wrong.
#include "report/schedule_trace.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <sstream>

#include "board/sim/sim_board.h"
#include "report/picture/page.h"
#include "report/plan_picture.h"

namespace qduino::apps::schedule_trace_test {
namespace {

using board::sim::SimBoard;
using board::sim::SimConfig;
using board::sim::TraceEvent;
using board::sim::TraceKind;
using runtime::Runtime;
using ::testing::HasSubstr;

constexpr Nanoseconds kLength = 250ms;

void wait_for_next_period() { Runtime::current()->wait_for_next_period(); }
SimBoard& sim() { return static_cast<SimBoard&>(Runtime::current()->board()); }

/// Loop 1 is preempted, loop 2 always wants more than its budget, loop 3 owns core 1, and the
/// network has an I/O VCPU.
runtime::SketchTable sketch() {
    const auto loop = [](board::VcpuId id, Nanoseconds budget, Nanoseconds period, int core, void (*body)()) {
        return runtime::LoopDeclaration{{id, budget, period, core}, body, "test.ino", id};
    };
    runtime::SketchTable table;
    table.loops.push_back(loop(1, 20ms, 100ms, 0, [] {
        sim().compute(19ms);
        wait_for_next_period();
    }));
    table.loops.push_back(loop(2, 3ms, 10ms, 0, [] {
        sim().compute(5ms);
        wait_for_next_period();
    }));
    table.loops.push_back(loop(3, 1ms, 1ms, 1, [] { sim().busy_for(1ms); }));
    table.setup = [] {
        if (!Runtime::current()->interrupts_vcpu(board::DeviceClass::nic, 1ms, 20ms, 0)) std::abort();
    };
    return table;
}

SimConfig computer() {
    SimConfig config;
    config.tick_period = 4ms;
    config.tick_cost = 15us;
    config.costs.context_switch = 20us;
    config.interrupts.push_back({.device = board::DeviceClass::nic,
                                 .rate_hz = 400,
                                 .core = 0,
                                 .top_half = 30us,
                                 .bottom_half = 200us});
    return config;
}

/// Tells the recorder what `tell` makes of an event: it may change it, or drop it (false).
class Mutant final : public board::sim::TraceSink {
  public:
    Mutant(ScheduleTrace& to, std::function<bool(TraceEvent&)> tell, bool drops_taken)
        : to_(to), tell_(std::move(tell)), drops_taken_(drops_taken) {}
    void on_event(const TraceEvent& event) override {
        TraceEvent told = event;
        if (tell_(told)) to_.on_event(told);
    }
    void on_budget(Nanoseconds left) override { to_.on_budget(left); }
    void on_ready(Instant now, int core, board::VcpuId vcpu) override { to_.on_ready(now, core, vcpu); }
    void on_taken(Instant now, int core, Instant from, Instant until) override {
        if (!drops_taken_) to_.on_taken(now, core, from, until);
    }

  private:
    ScheduleTrace& to_;
    std::function<bool(TraceEvent&)> tell_;
    bool drops_taken_;
};

/// The bars of a page, in nanoseconds: of each VCPU by core and kind, of each core what was taken.
struct Bars {
    std::map<std::pair<int, int>, std::map<std::string, double>> by_vcpu;
    std::map<int, double> taken;
    int missed = 0;
};

/// The text of an attribute in a piece of the page; empty when it has none.
std::string attribute(std::string_view piece, std::string_view name) {
    const std::string key = ' ' + std::string(name) + "=\"";
    const std::size_t at = piece.find(key);
    if (at == std::string_view::npos) return {};
    const std::string_view rest = piece.substr(at + key.size());
    return std::string(rest.substr(0, rest.find('"')));
}

Bars bars_of(const std::string& page) {
    const auto number = [&page](const char* name) { return std::stod(attribute(page, name)); };
    const double scale = (number("data-until-ns") - number("data-from-ns")) / number("data-width");
    Bars bars;
    std::istringstream lines(page);
    int core = -1, vcpu = -1;
    for (std::string line; std::getline(lines, line);) {
        if (line.starts_with("<g class=\"core\"")) {
            core = std::stoi(attribute(line, "data-core"));
            vcpu = -1;
        } else if (line.starts_with("<g class=\"vcpu")) {
            vcpu = std::stoi(attribute(line, "data-vcpu"));
        } else if (core >= 0 && line.starts_with("<rect ")) {
            const double ns = std::stod(attribute(line, "width")) * scale;
            const std::string kinds = attribute(line, "class"), kind = kinds.substr(0, kinds.find(' '));
            (kind == "taken" ? bars.taken[core] : bars.by_vcpu[{core, vcpu}][kind]) += ns;
        } else if (core >= 0 && attribute(line, "class") == "missed") {
            ++bars.missed;
        }
    }
    return bars;
}

/// What the page says otherwise than the simulator's accounts; empty when they agree.
std::string disagreement(const std::string& page, const SimBoard& board, const Runtime& runtime) {
    const Bars bars = bars_of(page);
    // A bar's width is rounded to a hundredth of a point, and a page has some thousand bars.
    const double tolerance = 2e5;
    std::string out;
    for (const board::VcpuSpec& vcpu : runtime.plan().specs()) {
        const auto drawn = bars.by_vcpu.find({vcpu.core, vcpu.id});
        const double runs =
            drawn == bars.by_vcpu.end() || !drawn->second.contains("runs") ? 0 : drawn->second.at("runs");
        const auto charged = static_cast<double>(board.cpu_time(vcpu.id).count());
        if (std::abs(runs - charged) > tolerance)
            write(out, picture::row_name(vcpu.id), ": drawn ", Fixed{runs, 0}, " ns, charged ",
                  Fixed{charged, 0}, " ns\n");
        // Wherever it wants more than its budget it is drawn as throttled, and nowhere else.
        const bool throttled = drawn != bars.by_vcpu.end() && drawn->second.contains("throttled");
        if (throttled != (vcpu.id == 2 || vcpu.is_io()))
            write(out, picture::row_name(vcpu.id), ": drawn as ", throttled ? "" : "never ", "throttled\n");
    }
    for (int core = 0; core < board.core_count(); ++core) {
        const double taken = bars.taken.contains(core) ? bars.taken.at(core) : 0;
        const auto stolen = static_cast<double>(board.stolen_time(core).count());
        if (std::abs(taken - stolen) > tolerance)
            write(out, "core ", core, ": drawn ", Fixed{taken, 0}, " ns taken, accounted ", Fixed{stolen, 0},
                  " ns\n");
    }
    std::int64_t overruns = 0;
    for (const board::VcpuId id : {1, 2, 3}) overruns += runtime.loop(id)->statistics.overruns.get();
    if (bars.missed != overruns)
        write(out, bars.missed, " missed deadlines drawn, ", overruns, " overruns counted\n");
    return out;
}

/// Runs the sketch, and returns what the judge says of the page.
std::string judged(const std::function<bool(TraceEvent&)>& tell, bool drops_taken = false) {
    ScheduleTrace trace;
    Mutant mutant(trace, tell, drops_taken);
    board::NoPeripherals wires;
    SimBoard board(computer(), wires, &mutant);
    Runtime runtime(board);
    if (const auto begun = runtime.begin(sketch()); !begun) return std::string(begun.error().message.view());
    trace.follow(runtime, kEpoch, kEpoch + 2 * kLength);
    runtime.run(kEpoch + kLength);
    board.request_stop();  // what has not ended is not charged whole
    runtime.run(kEpoch + 2 * kLength);
    if (!board.stopped()) return "a loop did not end";
    const picture::Schedule schedule = trace.finish(board.now());
    return disagreement(picture::svg_page(schedule), board, runtime);
}

bool as_it_is(TraceEvent&) { return true; }

TEST(ScheduleTrace, ThePageAgreesWithTheSimulatorsAccounts) { EXPECT_EQ(judged(as_it_is), ""); }

TEST(ScheduleTrace, AMutantThatDropsThrottlingIsCaught) {
    const std::string said = judged([](TraceEvent& event) { return event.kind != TraceKind::throttle; });
    EXPECT_THAT(said, HasSubstr("loop 2: drawn as never throttled"));
}

TEST(ScheduleTrace, AMutantThatShiftsACoreIsCaught) {
    const std::string said = judged([](TraceEvent& event) {
        event.core = static_cast<std::uint8_t>(1 - event.core);
        return true;
    });
    EXPECT_THAT(said, HasSubstr("loop 1: drawn "));
}

TEST(ScheduleTrace, AMutantThatDropsPreemptionIsNotNeeded) {
    // A VCPU that loses its core to another is known to wait, whether or not that is told.
    EXPECT_EQ(judged([](TraceEvent& event) { return event.kind != TraceKind::preempt; }), "");
}

TEST(ScheduleTrace, AMutantThatForgetsToStopIsCaught) {
    EXPECT_NE(judged([](TraceEvent& event) { return event.kind != TraceKind::block; }), "");
}

TEST(ScheduleTrace, AMutantThatDropsReleasesIsCaught) {
    const std::string said = judged([](TraceEvent& event) { return event.kind != TraceKind::release; });
    EXPECT_THAT(said, HasSubstr("0 missed deadlines drawn"));
}

TEST(ScheduleTrace, AMutantThatDropsInterruptsIsCaught) {
    EXPECT_THAT(judged(as_it_is, true), HasSubstr("core 0: drawn 0 ns taken"));
}

TEST(ScheduleTrace, TheWorstResponseIsThatOfARelease) {
    ScheduleTrace trace;
    board::NoPeripherals wires;
    SimBoard board({}, wires, &trace);
    Runtime runtime(board);
    runtime::SketchTable table;
    table.loops.push_back({{1, 20ms, 100ms, 0},
                           [] {
                               sim().compute(10ms);
                               wait_for_next_period();
                           },
                           "test.ino",
                           1});
    table.loops.push_back({{2, 5ms, 20ms, 0},
                           [] {
                               sim().compute(4ms);
                               wait_for_next_period();
                           },
                           "test.ino",
                           2});
    ASSERT_TRUE(runtime.begin(table));
    trace.follow(runtime, kEpoch, kEpoch + 50ms);
    runtime.run(kEpoch + 1s);
    const picture::Schedule schedule = trace.finish(board.now());
    std::vector<picture::Response> responses = responses_of(runtime.plan());
    add_seen(schedule, responses);
    ASSERT_EQ(responses.size(), 2u);
    EXPECT_EQ(responses[0].seen, 14ms);
    EXPECT_EQ(responses[1].seen, 4ms);
    EXPECT_GE(responses[0].worst, responses[0].seen);
    EXPECT_GE(responses[1].worst, responses[1].seen);
}

}  // namespace
}  // namespace qduino::apps::schedule_trace_test
