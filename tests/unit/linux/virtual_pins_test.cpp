// Both ends of the virtual pins: in one process, and across fork with a sketch that dies at any
// moment.
#include "board/linux/pin/virtual_pins.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <random>

#include "tests/unit/linux/pins_fixture.h"

namespace qduino::board::linux::test::virtual_pins_test {
namespace {

constexpr PinId kPin{7};
constexpr PinId kOther{8};

TEST(VirtualPins, CarryEdgesInOrderWithTheirInstants) {
    TemporaryPins file;
    RunningMachine running{file.path()};
    VirtualPins pins;
    attach(pins, file.path());
    ASSERT_TRUE(pins.set_mode(0, kPin, PinMode::output).ok());
    const Instant before = monotonic_now();
    for (int i = 0; i < 1000; ++i) pins.write(0, kPin, i % 2 ? Level::low : Level::high);
    const Instant after = monotonic_now();
    running.stop();

    const auto& seen = running.machine.seen;
    ASSERT_EQ(seen.size(), 1001u);  // pinMode(OUTPUT) drives the latch once
    EXPECT_EQ(seen[0].value, 0.0);
    for (std::size_t i = 1; i < seen.size(); ++i) {
        EXPECT_EQ(seen[i].value, i % 2 ? 1.0 : 0.0);
        EXPECT_GE(seen[i].time, std::max(before, seen[i - 1].time));
        EXPECT_LE(seen[i].time, after);
    }
    EXPECT_EQ(running.server().faults().disordered, 0u);
}

TEST(VirtualPins, WhatIsWrittenTogetherHasOneInstant) {
    PolledPins ends;
    ASSERT_TRUE(ends.pins.open_writer(1, false).ok());
    const std::array pins{kPin, PinId{9}, kOther};
    for (const PinId pin : {kPin, kOther}) ASSERT_TRUE(ends.pins.set_mode(1, pin, PinMode::output).ok());
    RecordingMachine machine;
    for (int i = 0; i < 100; ++i) {
        ends.server.poll(monotonic_now(), machine);
        machine.seen.clear();
        // Before, pin 9 is an input: the others are driven all the same.
        const bool all_drive = i >= 50;
        if (i == 50) {
            ASSERT_TRUE(ends.pins.set_mode(1, pins[1], PinMode::output).ok());
        }
        ends.server.poll(monotonic_now(), machine);
        machine.seen.clear();
        const Instant before = monotonic_now();
        ends.pins.write_all(1, pins, i % 2 == 0 ? Level::high : Level::low);
        const Instant after = monotonic_now();
        ends.server.poll(monotonic_now(), machine);
        ASSERT_EQ(machine.seen.size(), all_drive ? 3u : 2u);
        for (const Seen& edge : machine.seen) {
            EXPECT_EQ(edge.value, i % 2 == 0 ? 1.0 : 0.0);
            EXPECT_GE(edge.time, before);
            EXPECT_LE(edge.time, after);
            if (all_drive) {
                EXPECT_EQ(edge.time, machine.seen[0].time);
            }
        }
        EXPECT_EQ(ends.pins.read(1, pins[1]), all_drive && i % 2 == 0 ? Level::high : Level::low);
    }
    EXPECT_EQ(ends.server.faults().disordered, 0u);
    EXPECT_EQ(ends.pins.lost_edges(), 0u);
}

TEST(VirtualPins, ANewWriterInTheMiddleOfItsFirstEdgeIsWaitedFor) {
    PolledPins ends;
    RecordingMachine machine;
    ASSERT_TRUE(ends.pins.open_writer(1, false).ok());
    WriterSlot& slot = ends.server.layout().writers[1];
    slot.writing.store(1);  // its edge has an instant now, and is not in the ring
    const Instant asked = monotonic_now();
    ends.server.poll(asked, machine);
    EXPECT_LT(ends.server.horizon(), asked - 1ms);
    slot.writing.store(0);
    ends.server.poll(asked, machine);
    EXPECT_EQ(ends.server.horizon(), asked);
}

TEST(VirtualPins, ARehearsedWriteIsNeverSeenNorLost) {
    PolledPins ends;
    ends.pins.rehearse_write(1);  // has no writer yet
    ASSERT_TRUE(ends.pins.open_writer(1, false).ok());
    ASSERT_TRUE(ends.pins.set_mode(1, kPin, PinMode::output).ok());  // one edge
    RecordingMachine machine;
    for (int i = 0; i < 10; ++i) {
        ends.pins.rehearse_write(1);
        ends.pins.write(1, kPin, i % 2 ? Level::low : Level::high);
        ends.pins.rehearse_write(1);
        ends.server.poll(monotonic_now(), machine);
        EXPECT_EQ(machine.seen.size(), static_cast<std::size_t>(i + 2));
        EXPECT_EQ(machine.seen.back().value, i % 2 ? 0.0 : 1.0);
    }
    for (std::size_t i = 0; i < NarrowRing::kCapacity; ++i) ends.pins.write(1, kPin, Level::high);
    ends.pins.rehearse_write(1);  // the ring is full
    EXPECT_EQ(ends.pins.lost_edges(), 0u);
}

/// As beside Linux: the pins are in existing memory, at an address, with whatever was in it.
TEST(VirtualPins, MayLieInTheMiddleOfADevice) {
    constexpr std::size_t kAt = 3 * kPinsPage;
    TemporaryPins device;
    const std::string path = device.path() + "@" + std::to_string(kAt);
    const posix::UniqueFd file{::open(device.path().c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)};
    ASSERT_EQ(::ftruncate(file.get(), static_cast<off_t>(kAt + ring_offset(kVcpuLimit))), 0);
    const std::vector<char> rubbish(4096, '\x5a');
    for (const std::size_t at : {kAt, kAt + ring_offset(1)})
        ASSERT_EQ(::pwrite(file.get(), rubbish.data(), rubbish.size(), static_cast<off_t>(at)), 4096);
    auto server = PinsServer::create(path, true);
    ASSERT_TRUE(server.ok()) << server.error().message.view();
    EXPECT_EQ(PinsServer::create(path, true).error().code, ErrorCode::unavailable) << "it has its machine";
    RecordingMachine machine;
    server->poll(server->past(), machine);
    auto ring = posix::map_shared(file.get(), kAt + ring_offset(1), ring_bytes(1), false);
    ASSERT_TRUE(ring->as<NarrowRing>()->try_push({1'000, kPin.number, PinEventKind::level, Level::high, 0}));
    server->layout().writers[1].in_use.store(2);
    server->layout().sketch_clock_ns.store(1'000);
    server->poll(server->past(), machine);
    ASSERT_EQ(machine.seen.size(), 1u);
    EXPECT_EQ(machine.seen[0].pin, kPin.number);
}

/// As a sketch in an emulated machine does it (board/metal/pins_window.cpp).
TEST(VirtualPins, ASketchMayHaveAClockOfItsOwn) {
    TemporaryPins file;
    auto server = PinsServer::create(file.path(), true);
    ASSERT_TRUE(server.ok());
    PinsLayout& layout = server->layout();
    RecordingMachine machine;
    server->poll(server->past(), machine);  // of before there is a sketch
    const auto ring = PinsFile::open(file.path(), PinsRole::sketch)->map_ring(1, true);
    const auto write = [&](std::int64_t time_ns, Level level) {
        ASSERT_TRUE(ring->as<NarrowRing>()->try_push({time_ns, kPin.number, PinEventKind::level, level, 0}));
        layout.sketch_clock_ns.store(time_ns);
    };
    layout.writers[1].in_use.store(2);
    write(1'000, Level::high);
    write(2'000, Level::low);
    EXPECT_EQ(server->past(), instant_from_ns(2'000));
    server->poll(server->past(), machine);
    ASSERT_EQ(machine.seen.size(), 2u);
    EXPECT_EQ(machine.seen[0].time, instant_from_ns(1'000));
    EXPECT_EQ(machine.seen[1].time, instant_from_ns(2'000));
    EXPECT_EQ(server->horizon(), instant_from_ns(2'000));
    EXPECT_EQ(layout.inputs_as_of_ns.load(), 2'000);
    // Nothing of the computer's own time came in: this edge is later than all before.
    write(3'000, Level::high);
    server->poll(server->past(), machine);
    ASSERT_EQ(machine.seen.size(), 3u);
    EXPECT_EQ(server->faults().disordered, 0u);
}

TEST(VirtualPins, AWriteToAPinThatIsNoOutputStaysInTheLatch) {
    TemporaryPins file;
    RunningMachine running{file.path()};
    VirtualPins pins;
    attach(pins, file.path());
    pins.write(0, kPin, Level::high);
    ASSERT_TRUE(pins.set_mode(0, kPin, PinMode::output).ok());
    EXPECT_EQ(pins.read(0, kPin), Level::high);
    running.stop();
    ASSERT_EQ(running.machine.seen.size(), 1u);
    EXPECT_EQ(running.machine.seen[0].value, 1.0);
}

TEST(VirtualPins, PwmKeepsItsDutyAndRefusesOneOutOfRange) {
    TemporaryPins file;
    RunningMachine running{file.path()};
    VirtualPins pins;
    attach(pins, file.path());
    EXPECT_TRUE(pins.write_pwm(0, kPin, 0.25).ok());
    for (const double wrong : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()}) {
        const auto refused = pins.write_pwm(0, kPin, wrong);
        ASSERT_FALSE(refused.ok());
        EXPECT_EQ(refused.error().code, ErrorCode::out_of_range);
    }
    running.stop();
    ASSERT_EQ(running.machine.seen.size(), 1u);
    EXPECT_TRUE(running.machine.seen[0].pwm);
    EXPECT_DOUBLE_EQ(running.machine.seen[0].value, 0.25);
}

TEST(VirtualPins, MergeSeveralWritersByTime) {
    TemporaryPins file;
    RunningMachine running{file.path()};
    VirtualPins pins;
    attach(pins, file.path());
    constexpr int kWriters = 6;
    constexpr int kEdges = 20'000;
    for (VcpuId vcpu = 1; vcpu <= kWriters; ++vcpu) {
        ASSERT_TRUE(pins.open_writer(vcpu, vcpu == 2).ok());
        ASSERT_TRUE(pins.set_mode(0, PinId{vcpu}, PinMode::output).ok());
    }
    std::vector<std::thread> threads;
    for (VcpuId vcpu = 1; vcpu <= kWriters; ++vcpu) {
        threads.emplace_back([&pins, vcpu] {
            for (int i = 0; i < kEdges; ++i) pins.write(vcpu, PinId{vcpu}, i % 2 ? Level::high : Level::low);
        });
    }
    for (auto& thread : threads) thread.join();
    running.stop();

    const auto& seen = running.machine.seen;
    EXPECT_EQ(seen.size(), static_cast<std::size_t>(kWriters * (kEdges + 1)));
    std::array<int, kWriters + 1> count{};
    Instant last{};
    for (const Seen& event : seen) {
        EXPECT_GE(event.time, last);
        last = event.time;
        int& edges = count[event.pin];
        if (edges > 0) {  // each writer's own order is kept, whatever happened to the others
            EXPECT_EQ(event.value, (edges - 1) % 2 ? 1.0 : 0.0);
        }
        ++edges;
    }
    EXPECT_EQ(running.server().faults().lost, 0u);
    EXPECT_EQ(running.server().faults().malformed, 0u);
}

TEST(VirtualPins, CountEdgesThatFindTheRingFullAndGoOn) {
    PolledPins ends;
    ASSERT_TRUE(ends.pins.open_writer(1, false).ok());
    ASSERT_TRUE(ends.pins.set_mode(1, kPin, PinMode::output).ok());  // one edge
    for (std::size_t i = 0; i < NarrowRing::kCapacity + 9; ++i) ends.pins.write(1, kPin, Level::high);
    EXPECT_EQ(ends.pins.lost_edges(), 10u);
    RecordingMachine machine;
    std::size_t served = 0;
    for (std::size_t batch = 0; (batch = ends.server.poll(monotonic_now(), machine)) != 0;) served += batch;
    EXPECT_EQ(served, NarrowRing::kCapacity);
    EXPECT_EQ(ends.server.faults().lost, 10u);
    ends.pins.write(1, kPin, Level::low);
    ends.server.poll(monotonic_now(), machine);
    EXPECT_EQ(machine.seen.back().value, 0.0);  // there is room again
}

TEST(VirtualPins, InputsAreKnownWhenPinModeReturnsAndFollowTheOutside) {
    TemporaryPins file;
    RunningMachine running{file.path()};
    running.machine.outside[kPin.number] = true;
    VirtualPins pins;
    attach(pins, file.path());
    EXPECT_EQ(pins.read(0, kOther), Level::low);
    ASSERT_TRUE(answered([&] { return pins.set_mode(0, kPin, PinMode::input); }).ok());
    EXPECT_EQ(pins.read(0, kPin), Level::high);
    EXPECT_EQ(pins.edges(kPin).rising, 1u);

    const std::uint32_t seen = pins.input_changes();
    running.machine.outside[kPin.number] = false;
    while (pins.input_changes() == seen) pins.wait_input_change(seen, monotonic_now() + 1s);
    EXPECT_EQ(pins.read(0, kPin), Level::low);
    EXPECT_EQ(pins.edges(kPin).falling, 1u);
}

TEST(VirtualPins, CarryBusTransactions) {
    TemporaryPins file;
    RunningMachine running{file.path()};
    VirtualPins pins;
    attach(pins, file.path());
    const std::array<std::uint8_t, 3> out{1, 2, 3};
    std::array<std::uint8_t, 4> in{};
    ASSERT_TRUE(answered([&] { return pins.transfer(0, I2cBus{1}, I2cAddress{0x48}, out, in); }).ok());
    EXPECT_EQ(in, (std::array<std::uint8_t, 4>{2, 3, 4, 0xEE}));

    const auto nobody = answered([&] { return pins.transfer(0, I2cBus{1}, I2cAddress{0x49}, out, in); });
    ASSERT_FALSE(nobody.ok());
    EXPECT_EQ(nobody.error().code, ErrorCode::timed_out);
    EXPECT_EQ(nobody.error().message.view(), "nobody at this address");

    std::vector<std::uint8_t> data(kMailBytes, 0x0F);
    ASSERT_TRUE(answered([&] { return pins.transfer(0, SpiBus{0}, SpiSettings{}, data); }).ok());
    EXPECT_EQ(data, std::vector<std::uint8_t>(kMailBytes, 0xF0));
    data.push_back(0);
    EXPECT_EQ(pins.transfer(0, SpiBus{0}, SpiSettings{}, data).error().code, ErrorCode::out_of_range);

    const auto level = answered([&] { return pins.read_analog(0, PinId{64}); });
    ASSERT_TRUE(level.ok());
    EXPECT_DOUBLE_EQ(*level, 0.25);
}

TEST(VirtualPins, SeveralLoopsUseTheBusAtOnce) {
    TemporaryPins file;
    RunningMachine running{file.path()};
    VirtualPins pins;
    attach(pins, file.path());
    std::atomic<int> wrong{0};
    std::vector<std::thread> threads;
    for (VcpuId vcpu : {1, 2, 3, 0, 0}) {  // 0 is shared by whoever is not a loop
        threads.emplace_back([&, vcpu] {
            for (int i = 0; i < 200; ++i) {
                const std::array<std::uint8_t, 2> out{static_cast<std::uint8_t>(i), vcpu};
                std::array<std::uint8_t, 2> in{};
                const auto done =
                    answered([&] { return pins.transfer(vcpu, I2cBus{0}, I2cAddress{0x48}, out, in); });
                if (!done || in[0] != static_cast<std::uint8_t>(i + 1) || in[1] != vcpu + 1) ++wrong;
            }
        });
    }
    for (auto& thread : threads) thread.join();
    EXPECT_EQ(wrong, 0);
}

TEST(VirtualPins, ABusThatNobodyServesTimesOutAndTheNextAnswerIsTheRightOne) {
    PolledPins ends;
    const std::array<std::uint8_t, 1> first{10};
    std::array<std::uint8_t, 1> in{};
    const Instant before = monotonic_now();
    const auto silent = ends.pins.transfer(0, I2cBus{0}, I2cAddress{0x48}, first, in);
    ASSERT_FALSE(silent.ok());
    EXPECT_EQ(silent.error().code, ErrorCode::timed_out);
    EXPECT_GE(monotonic_now() - before, kBusTimeout);

    RecordingMachine machine;
    ends.server.poll(monotonic_now(), machine);  // answers the transaction that was given up
    std::atomic<bool> stop{false};
    std::thread serving{[&] {
        while (!stop) {
            ends.server.wait(1ms);
            ends.server.poll(monotonic_now(), machine);
        }
    }};
    const std::array<std::uint8_t, 1> second{20};
    EXPECT_TRUE(
        answered([&] { return ends.pins.transfer(0, I2cBus{0}, I2cAddress{0x48}, second, in); }).ok());
    EXPECT_EQ(in[0], 21);
    stop = true;
    serving.join();
}

TEST(VirtualPins, ATransactionComesAfterTheEdgesThatWereWrittenBeforeIt) {
    TemporaryPins file;
    RunningMachine running{file.path()};
    VirtualPins pins;
    attach(pins, file.path());
    ASSERT_TRUE(pins.set_mode(0, kPin, PinMode::output).ok());
    for (int i = 0; i < 100; ++i) {
        pins.write(0, kPin, Level::high);
        std::array<std::uint8_t, 1> in{};
        ASSERT_TRUE(answered([&] { return pins.transfer(0, I2cBus{0}, I2cAddress{0x48}, {}, in); }).ok());
        ASSERT_EQ(running.machine.edges, static_cast<std::size_t>(i + 2));
        EXPECT_LE(running.machine.last_edge_ns, running.machine.last_transaction_ns);
    }
}

TEST(VirtualPins, RefuseASecondSketchAndASecondMachine) {
    PolledPins ends;
    VirtualPins second;
    const auto refused = second.attach(ends.file.path());
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::unavailable);
    const auto other = PinsServer::create(ends.file.path());
    ASSERT_FALSE(other.ok());
    EXPECT_EQ(other.error().code, ErrorCode::unavailable);
}

TEST(VirtualPins, RefuseAFileThatIsNone) {
    TemporaryPins file;
    VirtualPins pins;
    EXPECT_EQ(pins.attach(file.path()).error().code, ErrorCode::not_found);
    { std::ofstream{file.path()} << "short"; }
    EXPECT_EQ(pins.attach(file.path()).error().code, ErrorCode::corrupt);
    { std::ofstream{file.path()} << std::string(kPinsFileSize / 64, 'x'); }
    EXPECT_EQ(pins.attach(file.path()).error().code, ErrorCode::corrupt);
}

TEST(VirtualPins, ForceEachSafePinAndNoOther) {
    TemporaryPins file;
    RunningMachine running{file.path()};
    VirtualPins pins;
    attach(pins, file.path());
    ASSERT_TRUE(pins.write_pwm(0, kPin, 0.75).ok());
    ASSERT_TRUE(pins.set_safe_state(kPin, Level::low).ok());
    ASSERT_TRUE(pins.set_mode(0, kOther, PinMode::output).ok());
    ASSERT_TRUE(pins.set_safe_state(kOther, Level::high).ok());
    ASSERT_TRUE(pins.set_mode(0, PinId{9}, PinMode::output).ok());
    pins.write(0, PinId{9}, Level::high);
    pins.force_safe_states();
    running.stop();

    std::array<double, 10> last{};
    for (const Seen& event : running.machine.seen) last[event.pin] = event.value;
    EXPECT_EQ(last[7], 0.0);
    EXPECT_EQ(last[8], 1.0);
    EXPECT_EQ(last[9], 1.0);
    EXPECT_FALSE(running.machine.seen.back().pwm);
    EXPECT_EQ(pins.read(0, kPin), Level::low);
}

// A sketch process that counts up on PWM pins for ever, as two loops would. (One thread plays both:
// a process forked from one with threads may make none under the thread sanitizer.)
[[noreturn]] void count_until_killed(const std::string& path) {
    VirtualPins pins;
    if (!pins.attach(path)) ::_exit(3);
    for (VcpuId vcpu : {1, 2}) {
        if (!pins.open_writer(vcpu, vcpu == 2)) ::_exit(4);
    }
    for (int i = 0;; ++i) {
        for (VcpuId vcpu : {1, 2}) static_cast<void>(pins.write_pwm(vcpu, PinId{vcpu}, (i & 1023) / 1024.0));
        std::array<std::uint8_t, 8> in{};
        if (i % 64 == 0) static_cast<void>(pins.transfer(1, I2cBus{0}, I2cAddress{0x48}, {}, in));
    }
}

TEST(VirtualPins, ASketchKilledAtAnyMomentLeavesNothingTornAndTheNextOneTakesOver) {
    TemporaryPins file;
    RunningMachine running{file.path()};
    const auto seed = static_cast<std::uint64_t>(std::random_device{}());
    std::mt19937_64 random{seed};
    SCOPED_TRACE("seed " + std::to_string(seed));
    constexpr int kLives = 12;
    for (int life = 0; life < kLives; ++life) {
        const pid_t child = ::fork();
        ASSERT_GE(child, 0);
        if (child == 0) count_until_killed(file.path());
        // Cleared by each that attaches.
        const auto& written = running.server().layout().outputs[1].pwm;
        // One comes so far.
        while (life == kLives - 1 && written.load() == 0) std::this_thread::sleep_for(1ms);
        std::this_thread::sleep_for(std::chrono::microseconds{2000 + random() % 15'000});
        ::kill(child, SIGKILL);
        int status = 0;
        ASSERT_EQ(::waitpid(child, &status, 0), child);
        ASSERT_TRUE(WIFSIGNALED(status)) << "the sketch left by itself with " << WEXITSTATUS(status);
    }
    running.stop();

    EXPECT_GE(running.server().sketch_session(), 1u);  // one that was killed early has not attached
    EXPECT_LE(running.server().sketch_session(), static_cast<std::uint64_t>(kLives));
    EXPECT_EQ(running.server().faults().malformed, 0u);
    std::array<int, 3> next{};
    int restarts = 0;
    for (const Seen& event :
         running.machine.seen) {  // each count goes up by one, or starts again with a new life
        ASSERT_LE(event.pin, 2);
        const int count = static_cast<int>(event.value * 1024);
        if (count != next[event.pin]) {
            ASSERT_EQ(count, 0) << "on pin " << event.pin;
            ++restarts;
        }
        next[event.pin] = (count + 1) & 1023;
    }
    EXPECT_LE(restarts, 2 * kLives);
    EXPECT_FALSE(running.machine.seen.empty());
}

TEST(VirtualPins, AnEdgeHasTheInstantAtWhichTheMachinePublishedIt) {
    PolledPins both;
    RecordingMachine machine;
    both.pins.layout().outputs[4].set_mode(PinMode::input);
    std::vector<Instant> before, after;
    for (std::uint32_t edge = 1; edge <= 20; ++edge) {
        before.push_back(monotonic_now());
        for (const bool level : {true, false}) {
            machine.outside[4] = level;
            both.server.poll(monotonic_now(), machine);
        }
        after.push_back(monotonic_now());
    }
    for (const Level to : {Level::high, Level::low}) {
        for (std::uint32_t edge = 20; edge > 20 - EdgeTimes::kKept + 1; --edge) {
            const Instant came = both.pins.edge_instant(PinId{4}, to, edge);
            EXPECT_GE(came, before[edge - 1]) << edge;
            EXPECT_LE(came, after[edge - 1]) << edge;
        }
        EXPECT_EQ(both.pins.edge_instant(PinId{4}, to, 4), kForever) << "forgotten";
    }
}

}  // namespace
}  // namespace qduino::board::linux::test::virtual_pins_test
