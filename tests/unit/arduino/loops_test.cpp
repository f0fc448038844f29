// The table after the loop declarations of loops_ms, loops_us and loops_cycles, and the calls
// around them.
#include <algorithm>

#include "arduino/core/constants.h"
#include "arduino/core/interrupts.h"
#include "arduino/core/loops.h"
#include "arduino/core/releases.h"
#include "tests/unit/arduino/arduino_fixture.h"

extern int loop_bodies_run;
int calls_of_client();
void routed_in_microseconds();
void routed_with_an_spi_object();

namespace {

using namespace std::chrono_literals;
using qduino::runtime::LoopDeclaration;
using qduino::runtime::sketch_table;

const LoopDeclaration* declared(int id) {
    const auto& loops = sketch_table().loops;
    const auto* found =
        std::find_if(loops.begin(), loops.end(), [&](const auto& one) { return one.id == id; });
    return found == loops.end() ? nullptr : found;
}

class ArduinoLoops : public ArduinoTest {
  protected:
    /// The I/O VCPUs that were asked for: "number: budget/period core N".
    std::vector<std::string> io_vcpus() {
        std::vector<std::string> asked;
        for (const auto& request : runtime_.plan().specs()) {
            if (!request.is_io()) continue;
            asked.push_back(
                std::to_string(request.id) + ": " + std::to_string(qduino::to_ns(request.budget)) + "/" +
                std::to_string(qduino::to_ns(request.period)) + " core " + std::to_string(request.core));
        }
        return asked;
    }
};

}  // namespace

TEST_F(ArduinoLoops, MillisecondsByDefault) {
    const LoopDeclaration* loop = declared(3);
    ASSERT_NE(loop, nullptr);
    EXPECT_EQ(loop->budget, 30ms);
    EXPECT_EQ(loop->period, 100ms);
    EXPECT_EQ(loop->core, qduino::runtime::kAnyCore);
    EXPECT_TRUE(std::string(loop->file).ends_with("loops_ms.cpp"));
    EXPECT_GT(loop->line, 0);
}

TEST_F(ArduinoLoops, ChronoLiteralsAndConstantExpressions) {
    const LoopDeclaration* loop = declared(7);
    ASSERT_NE(loop, nullptr);
    EXPECT_EQ(loop->budget, 10us);
    EXPECT_EQ(loop->period, 100us);
    EXPECT_EQ(loop->core, 1);
    ASSERT_NE(declared(4), nullptr);
    EXPECT_EQ(declared(4)->budget, 500us) << "half a millisecond";
}

TEST_F(ArduinoLoops, TheBodyIsTheSketchsAndMethodsNamedLoopAreCalls) {
    loop_bodies_run = 0;
    declared(3)->body();
    EXPECT_EQ(loop_bodies_run, 1);
    declared(7)->body();
    EXPECT_EQ(loop_bodies_run, 1 + 3);
    EXPECT_EQ(calls_of_client(), 1 + 3);
}

TEST_F(ArduinoLoops, TheClassicLoopIsEightyOfAHundredMilliseconds) {
    ASSERT_NE(sketch_table().setup, nullptr);
    const LoopDeclaration* loop = declared(1);
    ASSERT_NE(loop, nullptr) << "the lowest free id";
    EXPECT_EQ(loop->budget, 80ms);
    EXPECT_EQ(loop->period, 100ms);
    EXPECT_EQ(loop->core, qduino::runtime::kAnyCore);
    EXPECT_TRUE(loop->classic);
    EXPECT_FALSE(declared(3)->classic);
    loop_bodies_run = 0;
    loop->body();
    EXPECT_EQ(loop_bodies_run, 1);
}

TEST_F(ArduinoLoops, TimeUnitHoldsInItsOwnFile) {
    EXPECT_EQ(declared(11)->budget, 100us);
    EXPECT_EQ(declared(11)->period, 100us);
    EXPECT_EQ(declared(12)->period, 8ms) << "a chrono literal says its unit itself";
    EXPECT_EQ(declared(13)->budget, 250us);
    EXPECT_EQ(declared(13)->period, 1ms);
    play_loop(11);
    declared(11)->body();
    EXPECT_TRUE(runtime_.loop(11)->waited);
}

TEST_F(ArduinoLoops, IoVcpusTakeTheUnitToo) {
    routed_in_microseconds();
    EXPECT_EQ(board().calls, (std::vector<std::string>{"device 1 io 33", "device 2 io 34", "attach"}));
    EXPECT_EQ(io_vcpus(),
              (std::vector<std::string>{"33: 200000/1000000 core 0", "34: 1000000/100000000 core 0",
                                        "35: 50000/500000 core 1"}));
    ASSERT_EQ(board().attached.size(), 1U);
    EXPECT_EQ(board().attached[0].io, 35);
    EXPECT_EQ(board().attached[0].edge, qduino::board::Edge::rising);
}

TEST_F(ArduinoLoops, DevicesAreWordsAndDoNotCollide) {
    routed_with_an_spi_object();
    EXPECT_EQ(io_vcpus(), std::vector<std::string>{"33: 1000/2000 core 0"});
    EXPECT_EQ(board().calls, (std::vector<std::string>{"device 2 io 33", "route 6 core 1 off",
                                                       "route 4 core 1 on", "timer core 1 on"}));
    EXPECT_EQ(errors(), std::vector<std::string>{"noTimer(1)"}) << "no loop owns core 1";
}

TEST_F(ArduinoLoops, HandlersAreHeldBackUntilTheyMayRunAgain) {
    static int handled = 0;
    attachInterrupt(
        2, [] { ++handled; }, RISING);
    noInterrupts();
    board().while_sleeping = [] {
        EXPECT_EQ(handled, 0);
        if (qduino::fake::state().now >= qduino::kEpoch + 1ms) interrupts();
    };
    board().attached[0].handler(board().attached[0].context);
    EXPECT_EQ(handled, 1);
    EXPECT_GE(board().now, qduino::kEpoch + 1ms);
}

TEST_F(ArduinoLoops, RefusalsAreReturnedAndReported) {
    board().refuse_everything = true;
    EXPECT_FALSE(noInterrupts(qduino::arduino::DeviceClass::all, 1));
    EXPECT_FALSE(noTimer(1));
    EXPECT_FALSE(safeState(5, HIGH));
    EXPECT_FALSE(interruptsVcpu(qduino::arduino::TimeUnit::ms, qduino::arduino::DeviceClass::i2c, 2, 1));
    EXPECT_EQ(errors(), (std::vector<std::string>{"noInterrupts(1)", "noTimer(1)", "safeState(5)",
                                                  "interruptsVcpu(1)"}));
}

TEST_F(ArduinoLoops, EdgesOfTheModes) {
    const auto handler = [] {};
    const std::pair<int, qduino::board::Edge> cases[] = {{RISING, qduino::board::Edge::rising},
                                                         {FALLING, qduino::board::Edge::falling},
                                                         {CHANGE, qduino::board::Edge::both},
                                                         {LOW, qduino::board::Edge::falling},
                                                         {HIGH, qduino::board::Edge::rising}};
    for (const auto& [mode, edge] : cases) {
        attachInterrupt(digitalPinToInterrupt(2), handler, mode);
        EXPECT_EQ(board().attached.back().edge, edge);
        EXPECT_EQ(board().attached.back().io, qduino::board::kFirstIoVcpu) << "the default I/O VCPU";
    }
    const std::size_t before = board().attached.size();
    attachInterrupt(2, nullptr, RISING);
    attachInterrupt(2, handler, 77);
    attachInterrupt(500, handler, RISING);
    EXPECT_EQ(board().attached.size(), before);
    EXPECT_EQ(errors().size(), 3U);
    detachInterrupt(2);
    EXPECT_EQ(board().calls.back(), "detach 2");
}

/// attachInterrupt(0, …) is pin 2 on an Uno and a Mega, and 1 is pin 3.
TEST_F(ArduinoLoops, OldNumbersOfInterrupts) {
    const auto handler = [] {};
    for (const auto& [number, pin] : {std::pair{0, 2},
                                      {1, 3},
                                      {digitalPinToInterrupt(0), 0},
                                      {digitalPinToInterrupt(1), 1},
                                      {digitalPinToInterrupt(2), 2},
                                      {digitalPinToInterrupt(19), 19}}) {
        attachInterrupt(number, handler, RISING);
        EXPECT_EQ(board().attached.back().pin, pin);
        detachInterrupt(number);
        EXPECT_EQ(board().calls.back(), "detach " + std::to_string(pin));
    }
    EXPECT_EQ(digitalPinToInterrupt(-1), NOT_AN_INTERRUPT);
    EXPECT_TRUE(errors().empty());
}

TEST_F(ArduinoLoops, OverrunPolicyAndSafeState) {
    static int lateness = 0;
    overrunPolicy(3, OverrunPolicy::call_back, [](std::uint8_t, std::chrono::nanoseconds late) {
        lateness = static_cast<int>(late.count());
    });
    EXPECT_EQ(runtime_.loop(3)->policy, OverrunPolicy::call_back);
    runtime_.loop(3)->on_overrun(3, 7ns);
    EXPECT_EQ(lateness, 7);
    EXPECT_TRUE(safeState(17, LOW));
    EXPECT_EQ(board().safe_states[17], 0);
    EXPECT_FALSE(safeState(999, LOW));
}
