// The guard of debug builds, linked into this program whatever the build: what a real-time loop may
// not do ends the program and names itself; what it may do, and what others do, passes.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <mutex>
#include <string>

#include "arduino/HardwareSerial.h"
#include "arduino/SPI.h"
#include "arduino/WString.h"
#include "arduino/Wire.h"
#include "arduino/core/channels.h"
#include "arduino/core/diagnostics.h"
#include "arduino/core/digital_io.h"
#include "arduino/core/releases.h"
#include "arduino/core/timing.h"
#include "arduino/host/serial_ports.h"
#include "arduino/libraries/EEPROM/EEPROM.h"
#include "board/linux/linux_board.h"
#include "board/real_time_mark.h"
#include "runtime/runtime.h"
#include "tests/unit/linux/pins_fixture.h"

namespace qduino::board::linux::test::real_time_guard_test {
namespace {

using Body = std::function<void()>;

LinuxConfig modest() {
    LinuxConfig config;
    // The rule is the same (real_time_mark.h), and no test holds up the machine.
    config.real_time = false;
    config.lock_memory = false;
    config.handle_signals = false;
    return config;
}

struct LoopKind {
    VcpuId id = 3;
    VcpuKind kind = VcpuKind::main;
    bool classic = false;
};

/// Runs `body` once as a loop of this kind, on a board of its own.
void run_as(LoopKind kind, Body body, LinuxConfig config = modest()) {
    auto board = LinuxBoard::open(std::move(config));
    ASSERT_TRUE(board.ok()) << board.error().message.view();
    VcpuSpec spec;
    spec.id = kind.id;
    spec.kind = kind.kind;
    spec.classic = kind.classic;
    spec.budget = 10ms;
    spec.period = 100ms;
    spec.core = 0;
    spec.entry = [](void* function) { (*static_cast<Body*>(function))(); };
    spec.context = &body;
    ASSERT_TRUE((*board)->start(std::array{spec}).ok());
    (*board)->request_stop();
    (*board)->run(kForever);
}

/// Where the optimiser cannot see that nobody needs it.
void* volatile memory;
std::mutex system_mutex;

struct Offence {
    const char* name;
    const char* called;  ///< as the guard says it
    void (*commit)();
};

class AnOffence : public ::testing::TestWithParam<Offence> {};

TEST_P(AnOffence, EndsTheProgramWithTheLoopsNumberAndItsName) {
    memory = std::malloc(32);
    const std::string said = std::string("loop 3 called ") + GetParam().called;
    EXPECT_EXIT(run_as({}, GetParam().commit), ::testing::KilledBySignal(SIGABRT), said);
    const std::string said_of_handler = std::string("I/O VCPU 33 called ") + GetParam().called;
    EXPECT_EXIT(run_as({.id = 33, .kind = VcpuKind::io}, GetParam().commit),
                ::testing::KilledBySignal(SIGABRT), said_of_handler);
}

TEST_P(AnOffence, IsNoneInTheClassicLoopNorBeforeNorAfter) {
    memory = std::malloc(32);
    GetParam().commit();
    memory = std::malloc(32);
    bool ran = false;
    run_as({.classic = true}, [&] {
        GetParam().commit();
        ran = true;
    });
    EXPECT_TRUE(ran);
    memory = std::malloc(32);
    GetParam().commit();
}

TEST_P(AnOffence, IsNoneWhereItIsAllowedAndIsOneAgainBehindThat) {
    memory = std::malloc(32);
    bool ran = false;
    run_as({}, [&] {
        const AllowAllocation allowed{"the test"};
        { const AllowAllocation nested{"the test"}; }
        GetParam().commit();
        ran = true;
    });
    EXPECT_TRUE(ran);
    memory = std::malloc(32);
    EXPECT_EXIT(run_as({},
                       [] {
                           { const AllowAllocation allowed{"the test"}; }
                           GetParam().commit();
                       }),
                ::testing::KilledBySignal(SIGABRT), "loop 3 called");
}

INSTANTIATE_TEST_SUITE_P(
    Each, AnOffence,
    ::testing::Values(
        Offence{"Malloc", "malloc", [] { memory = std::malloc(32); }},
        Offence{"Calloc", "calloc", [] { memory = std::calloc(4, 8); }},
        Offence{"Realloc", "realloc", [] { memory = std::realloc(memory, 64); }},
        Offence{"Free", "free",
                [] {
                    std::free(memory);
                    memory = nullptr;
                }},
        Offence{"AlignedAlloc", "aligned_alloc", [] { memory = std::aligned_alloc(64, 128); }},
        Offence{"New", "operator new", [] { memory = ::operator new(16); }},
        Offence{"NewArray", "operator new", [] { memory = ::operator new[](16); }},
        Offence{"NewAligned", "operator new", [] { memory = ::operator new (128, std::align_val_t{64}); }},
        Offence{"Delete", "operator delete",
                [] {
                    ::operator delete(memory);
                    memory = nullptr;
                }},
        Offence{"ArduinoString", "operator new",
                [] {
                    String text("a text that is too long to be held in the object itself ");
                    text += 42;
                    memory = const_cast<char*>(text.c_str());
                }},
        Offence{"Mutex", "pthread_mutex_lock", [] { const std::lock_guard lock{system_mutex}; }}),
    [](const auto& tested) { return std::string(tested.param.name); });

TEST(RealTimeGuard, LetsTheAbortGoThroughTheSafeStates) {
    TemporaryPins file;
    auto server = PinsServer::create(file.path());
    ASSERT_TRUE(server.ok());
    const pid_t sketch = ::fork();
    if (sketch == 0) {
        static_cast<void>(!std::freopen("/dev/null", "w", stderr));
        LinuxConfig config = modest();
        config.pins_path = file.path();
        config.handle_signals = true;
        auto board = LinuxBoard::open(config);
        static_cast<void>((*board)->pin_mode(PinId{3}, PinMode::output));
        static_cast<void>((*board)->safe_state(PinId{3}, Level::low));
        (*board)->pin_write(PinId{3}, Level::high);
        Body body = [] { memory = std::malloc(32); };
        VcpuSpec spec;
        spec.id = 1;
        spec.budget = 10ms;
        spec.period = 100ms;
        spec.core = 0;
        spec.entry = [](void* function) { (*static_cast<Body*>(function))(); };
        spec.context = &body;
        static_cast<void>((*board)->start(std::array{spec}));
        (*board)->run(kForever);
        ::_exit(0);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(sketch, &status, 0), sketch);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT) << status;
    RecordingMachine machine;
    std::this_thread::sleep_for(kWriterHold + 1ms);
    while (server->poll(monotonic_now(), machine) > 0) {
    }
    ASSERT_GE(machine.seen.size(), 2u);
    EXPECT_EQ(machine.seen[machine.seen.size() - 2].value, 1.0);
    EXPECT_EQ(machine.seen.back().value, 0.0);
}

// ---- what a real-time loop does all the time ----------------------------------------------------

class CleanLoop : public ::testing::Test {
  protected:
    /// One pass of everything that the face offers to a loop.
    static void use_the_face() {
        digitalWrite(3, HIGH);
        analogWrite(4, 100);
        static_cast<void>(digitalRead(5));
        static_cast<void>(analogRead(A0));
        Wire.beginTransmission(0x48);
        Wire.write(std::uint8_t{0x84});
        Wire.endTransmission(false);
        static_cast<void>(Wire.requestFrom(0x48, std::size_t{2}));
        SPI.beginTransaction(SPISettings{});
        static_cast<void>(SPI.transfer(std::uint8_t{7}));
        SPI.endTransaction();
        Serial1.print("temperature ");
        Serial1.println(21.5, 3);
        static_cast<void>(Serial1.read());
        {
            mutex.lock();
            numbers.write(passes);
            static_cast<void>(numbers.read());
            mutex.unlock();
        }
        latest.write(millis());
        EEPROM.write(1, static_cast<std::uint8_t>(passes));
        tone(8, 440, 1);
        digitalWrite(500, HIGH);  // refused, and reported
        delayMicroseconds(5);
        if (++passes == 5) stopSketch();
        waitForNextPeriod();
    }
    static inline int passes = 0;
    static inline Mutex mutex;
    static inline RingBuffer<int, 4> numbers;
    static inline Channel<unsigned long> latest;
};

TEST_F(CleanLoop, TheFaceNeitherAllocatesNorLocks) {
    TemporaryPins file;
    RunningMachine running{file.path()};
    arduino::host::PseudoTerminalPort terminal{""};
    LinuxConfig config = modest();
    config.pins_path = file.path();
    auto board = LinuxBoard::open(config);
    ASSERT_TRUE(board.ok()) << board.error().message.view();
    runtime::Runtime runtime(**board);
    for (const int pin : {3, 8}) pinMode(pin, OUTPUT);
    Serial1.begin(115200, SERIAL_8N1, terminal);
    ::setenv("QDUINO_EEPROM", (file.path() + ".eeprom").c_str(), 1);
    const std::uint32_t reported_before = arduino::error_count();

    runtime::SketchTable table;
    runtime::LoopDeclaration loop;
    loop.id = 3;
    loop.budget = 10ms;
    loop.period = 50ms;
    loop.body = &use_the_face;
    table.loops.push_back(loop);
    const auto begun = runtime.begin(table);
    ASSERT_TRUE(begun.ok()) << begun.error().message.view();
    runtime.run(kForever);
    EXPECT_EQ(passes, 5);
    EXPECT_EQ(arduino::error_count() - reported_before, 5u);
    Serial1.end();
    ::unlink((file.path() + ".eeprom").c_str());
}

TEST_F(CleanLoop, ASketchsClassicLoopIsNotGuardedAndItsOtherLoopIs) {
    const auto run_sketch = [](bool classic) {
        auto board = LinuxBoard::open(modest());
        runtime::Runtime runtime(**board);
        runtime::SketchTable table;
        runtime::LoopDeclaration loop;
        loop.id = 1;
        loop.budget = 80ms;
        loop.period = 100ms;
        loop.classic = classic;
        loop.body = [] {
            memory = std::malloc(32);
            stopSketch();
        };
        table.loops.push_back(loop);
        if (runtime.begin(table)) runtime.run(kForever);
    };
    memory = nullptr;
    run_sketch(true);
    EXPECT_NE(memory, nullptr);
    EXPECT_EXIT(run_sketch(false), ::testing::KilledBySignal(SIGABRT), "loop 1 called malloc");
}

}  // namespace
}  // namespace qduino::board::linux::test::real_time_guard_test
