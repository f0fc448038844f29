// Code that asks the board for nothing: no run hangs in it, and the same spin is the same every
// time.
#include <gtest/gtest.h>

#include <limits>

#include "board/sim/endless_jump.h"
#include "sim_fixture.h"
#include "spin_code.h"

namespace qduino::board::sim::testing::sim_spin_test {
namespace {

/// A computer that takes little for a spin, and what runs on it.
struct Bench {
    explicit Bench(int cores = 2) : board(config(cores), wires, &trace) {}
    static SimConfig config(int cores) {
        SimConfig config;
        config.cores = cores;
        config.spin_limit = 4 * kBlocksPerLook;
        return config;
    }
    void run(Nanoseconds length) {
        ASSERT_TRUE(board.start(program.specs()));
        board.run(at(length));
    }
    /// The last spin of `vcpu`; nothing where it had none.
    [[nodiscard]] SpinSeen spin_of(VcpuId vcpu) const {
        for (const SpinSeen& seen : board.spins()) {
            if (seen.vcpu == vcpu) return seen;
        }
        return {};
    }

    NoPeripherals wires;
    KeptTrace trace;
    SimBoard board;
    Program program;
};

TEST(SimSpin, AJumpToItselfUsesItsBudgetAndOthersGoOn) {
    Bench bench;
    const EndlessJumps jumps(bench.board.event_loop(), nullptr);
    int releases = 0;
    bench.program.loop(1, 3ms, 10ms, 0, [] { jump_to_itself(); })
        .loop(2, 1ms, 20ms, 0,
              periodic_work(bench.board, 500us, 20ms, [&](Instant, Instant) { ++releases; }));
    bench.run(200ms);
    EXPECT_EQ(bench.board.now(), at(200ms));
    EXPECT_EQ(releases, 10);
    EXPECT_EQ(bench.board.cpu_time(VcpuId{1}), 60ms);  // 3 in each 10 ms
    EXPECT_EQ(bench.trace.count(TraceKind::throttle, 1), 20u);
    EXPECT_TRUE(bench.spin_of(1).goes_on);
    EXPECT_TRUE(bench.spin_of(1).spin.endless);
    EXPECT_EQ(bench.spin_of(1).spin.begun, at(0s));
}

TEST(SimSpin, AnotherLoopEndsASpinAtTheInstantAtWhichItSetsTheFlag) {
    Bench bench;
    volatile bool flag = false;
    Instant seen;
    bench.program
        .owning_loop(1, 100us, 0,
                     [&] {
                         spin_until(flag);
                         seen = bench.board.now();
                     })
        .loop(2, 1ms, 10ms, 1, [&] {
            bench.board.sleep_until(at(1234567us));
            flag = true;
        });
    bench.run(2s);
    EXPECT_EQ(seen, at(1234567us));
    EXPECT_FALSE(bench.spin_of(1).goes_on);
    EXPECT_EQ(bench.spin_of(1).spin.lasted, 1234567us);
}

/// A loop that asks the host's system again and again, and is told no.
struct Asking {
    explicit Asking(SimBoard& on, std::int64_t times = std::numeric_limits<std::int64_t>::max())
        : board(on), left(times) {}
    static bool ask(void* context) {
        Asking& self = *static_cast<Asking*>(context);
        self.board.device_work(DeviceClass::nic, 0);
        ++self.asked;
        return --self.left <= 0;
    }
    SimBoard& board;
    std::int64_t left, asked = 0;
};

TEST(SimSpin, AQuestionToTheHostCostsTimeBeyondTheLimitOfOneInstant) {
    SimConfig config = Bench::config(1);
    config.poll_limit = 100;
    config.poll_cost = 50ns;
    NoPeripherals wires;
    SimBoard board(config, wires);
    Asking few(board, 99), more(board, 150);
    Instant after_few, after_more;
    Program program;
    program.loop(1, 80ms, 100ms, 0, [&] {
        ask_until(&Asking::ask, &few);
        after_few = board.now();  // the 100th
        board.sleep_until(at(100ms));
        ask_until(&Asking::ask, &more);
        after_more = board.now();
        board.sleep_until(kForever);
    });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(200ms));
    EXPECT_EQ(after_few, at(0s));
    EXPECT_EQ(after_more, at(100ms + 50 * 20 * 50ns + 50ns));
}

TEST(SimSpin, AnEndlessQuestionToTheHostIsASpinFromItsBeginningAndEndsWithTheRun) {
    Bench bench;
    Asking asking(bench.board);
    bench.program.owning_loop(1, 100us, 0, [&] { ask_until(&Asking::ask, &asking); });
    bench.run(100s);
    EXPECT_EQ(bench.board.now(), at(100s));
    EXPECT_LT(asking.asked, 400'000) << "the host was not asked 50 million times";
    EXPECT_TRUE(bench.spin_of(1).goes_on);
    EXPECT_EQ(bench.spin_of(1).spin.begun, at(0s));
}

TEST(SimSpin, ALoopThatAsksForTheTimeAsWellIsNoSpinAndAsksNoMoreThanAHostCanAnswer) {
    Bench bench;
    Asking asking(bench.board);
    // Its body returns: `void loop() { client = server.available(); … millis() … }`
    bench.program.owning_loop(1, 100us, 0, [&] {
        while (bench.board.now() < at(1s)) Asking::ask(&asking);
    });
    bench.run(1s);
    EXPECT_LT(asking.asked, 500'000);
    EXPECT_FALSE(bench.spin_of(1).goes_on);
}

TEST(SimSpin, ALoopThatAsksForTheTimeBeforeTheHostIsNoSpin) {
    Bench bench;
    const auto both = [](void* context) {
        SimBoard& board = *static_cast<SimBoard*>(context);
        static_cast<void>(board.now());
        board.device_work(DeviceClass::nic, 0);
        return false;
    };
    bench.program.owning_loop(1, 100us, 0, [&] { ask_until(both, &bench.board); });
    bench.run(1s);
    EXPECT_EQ(bench.board.now(), at(1s));
    EXPECT_FALSE(bench.spin_of(1).goes_on);
}

/// A loop of calls that cost no virtual time, and the host more than a block of code.
void calls_in_vain(void (*call)(SimBoard&)) {
    Bench bench;
    struct Calls {
        SimBoard& board;
        void (*call)(SimBoard&);
        std::int64_t done;
    } calls{bench.board, call, 0};
    const auto once = [](void* context) {
        Calls& all = *static_cast<Calls*>(context);
        all.call(all.board);
        ++all.done;
        return false;
    };
    bench.program.owning_loop(1, 100us, 0, [&] { ask_until(once, &calls); });
    bench.run(1s);
    EXPECT_EQ(bench.board.now(), at(1s));
    EXPECT_TRUE(bench.spin_of(1).goes_on);
    EXPECT_LT(calls.done, 200'000) << "as many as blocks would be 20 million";
}

TEST(SimSpin, AnEndlessTextOnSerialEndsAsSoonAsASpinOfBlocks) {
    calls_in_vain([](SimBoard& board) { board.device_work(DeviceClass::uart, 1); });
}

TEST(SimSpin, EndlessLockingEndsAsSoonAsASpinOfBlocks) {
    calls_in_vain([](SimBoard& board) {
        LockWord word;
        board.lock(word);
        board.unlock(word);
    });
}

TEST(SimSpin, EndlessTryingOfALockEndsAsSoonAsASpinOfBlocks) {
    calls_in_vain([](SimBoard& board) {
        LockWord word;
        if (board.try_lock(word)) board.unlock(word);
    });
}

/// Every input rises at an instant.
class Rising final : public NoPeripherals {
  public:
    explicit Rising(Instant when) : when_(when) {}
    Level pin_level(Instant now, PinId) override { return now >= when_ ? Level::high : Level::low; }

  private:
    Instant when_;
};

TEST(SimSpin, AHandlerEndsASpinOnItsOwnCore) {
    Rising wire(at(50ms));
    SimBoard board(Bench::config(1), wire);
    static volatile bool flag;
    flag = false;
    ASSERT_TRUE(board.attach_edge(
        PinId{3}, Edge::rising, [](void*) { flag = true; }, nullptr, kFirstIoVcpu));
    Instant seen;
    Program program;
    program
        .loop(1, 80ms, 100ms, 0,
              [&] {
                  spin_until(flag);
                  seen = board.now();
              })
        .io(kFirstIoVcpu, 1ms, 10ms, 0);
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(1s));
    EXPECT_EQ(seen, at(50ms));
}

TEST(SimSpin, ASpinInAHandlerTakesItsBudgetOnly) {
    Rising wire(at(5ms));
    SimBoard board(Bench::config(1), wire);
    const EndlessJumps jumps(board.event_loop(), nullptr);
    ASSERT_TRUE(board.attach_edge(
        PinId{3}, Edge::rising, [](void*) { jump_to_itself(); }, nullptr, kFirstIoVcpu));
    int releases = 0;
    Program program;
    program.loop(1, 5ms, 10ms, 0, periodic_work(board, 1ms, 10ms, [&](Instant, Instant) { ++releases; }))
        .io(kFirstIoVcpu, 1ms, 10ms, 0);
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(1s));
    EXPECT_EQ(board.now(), at(1s));
    EXPECT_EQ(releases, 100);
}

TEST(SimSpin, TwoSpinsAnswerEachOtherWithinATenthOfAMillisecond) {
    Bench bench;
    volatile bool ping = false;
    volatile bool pong = false;
    int rounds = 0;
    bench.program
        .owning_loop(1, 100us, 0,
                     [&] {
                         while (rounds < 100) {
                             ping = true;
                             spin_until(pong);
                             pong = false;
                             ++rounds;
                         }
                     })
        .owning_loop(2, 100us, 1, [&] {
            while (!bench.board.stop_requested()) {
                spin_until(ping);
                ping = false;
                pong = true;
            }
        });
    bench.run(1s);
    EXPECT_EQ(rounds, 100);
    EXPECT_LE(bench.spin_of(1).spin.seen, at(30ms));
}

TEST(SimSpin, WhatEndsBeforeTheLimitTakesNoTime) {
    Bench bench;
    Instant after = kForever;
    bench.program.owning_loop(1, 100us, 0, [&] {
        compute(2 * kBlocksPerLook);
        after = bench.board.now();
    });
    bench.run(1ms);
    EXPECT_EQ(after, at(0s));
    EXPECT_EQ(bench.spin_of(1).spin.stack.depth, 0u);
}

TEST(SimSpin, WhatComputesBeyondTheLimitTakesTimeAndEnds) {
    Bench bench;
    Instant after = kForever;
    bench.program.owning_loop(1, 100us, 0, [&] {
        compute(8 * kBlocksPerLook);
        after = bench.board.now();
    });
    bench.run(100ms);
    EXPECT_GE(after, at(65us));
    EXPECT_LE(after, at(1ms));
    EXPECT_FALSE(bench.spin_of(1).goes_on);
}

/// setup() has no argument.
Bench* in_setup = nullptr;

TEST(SimSpin, ASetupThatNeverEndsIsLeftWhenItsTimeIsOver) {
    Bench bench;
    in_setup = &bench;
    volatile static bool never = false;
    EXPECT_FALSE(bench.board.run_setup([] { spin_until(never); }, at(300ms)));
    EXPECT_EQ(bench.board.now(), at(300ms));
    EXPECT_TRUE(bench.spin_of(kNoVcpu).goes_on);
    bool ran = false;
    bench.program.loop(1, 1ms, 10ms, 0, [&] { ran = true; });
    bench.run(400ms);
    EXPECT_TRUE(ran);
}

TEST(SimSpin, ASetupThatJumpsToItselfIsLeftToo) {
    Bench bench;
    const EndlessJumps jumps(bench.board.event_loop(), nullptr);
    EXPECT_FALSE(bench.board.run_setup([] { jump_to_itself(); }, at(10ms)));
    EXPECT_FALSE(bench.board.run_setup(nullptr, at(20ms)));
    EXPECT_EQ(bench.board.now(), at(20ms));
}

TEST(SimSpin, ASetupMaySleepThroughItsSlicesAndEnd) {
    Bench bench;
    in_setup = &bench;
    const auto setup = [] {
        in_setup->board.sleep_until(at(25ms));
        in_setup->board.busy_for(10ms);
    };
    EXPECT_FALSE(bench.board.run_setup(setup, at(10ms)));
    EXPECT_FALSE(bench.board.run_setup(setup, at(20ms)));
    EXPECT_FALSE(bench.board.run_setup(setup, at(30ms)));
    EXPECT_EQ(bench.board.now(), at(30ms));
    EXPECT_TRUE(bench.board.run_setup(setup, at(40ms)));
    EXPECT_EQ(bench.board.now(), at(35ms));
}

/// What a spin counted until a flag came, and the run's hash.
std::pair<std::uint64_t, std::uint64_t> counted_run() {
    Bench bench;
    volatile bool flag = false;
    std::uint64_t count = 0;
    bench.program.loop(1, 2ms, 10ms, 0, [&] { count = count_until(flag); }).loop(2, 1ms, 10ms, 1, [&] {
        bench.board.sleep_until(at(77ms));
        flag = true;
    });
    EXPECT_TRUE(bench.board.start(bench.program.specs()));
    bench.board.run(at(200ms));
    return {count, bench.board.trace_hash()};
}

TEST(SimSpin, ASpinThatCountsCountsTheSameEveryTime) {
    const auto first = counted_run();
    EXPECT_GT(first.first, std::uint64_t{kBlocksPerLook});
    // The blocks before the first look depend on what ran before in this process.
    block_count.left = kBlocksPerLook;
    const auto second = counted_run();
    block_count.left = kBlocksPerLook;
    EXPECT_EQ(second, counted_run());
}

TEST(SimSpin, TheCompilersWordForALoopThatNeverEndsIsKnown) {
#if defined(__x86_64__)
    const std::uint8_t itself[] = {0x90, 0xeb, 0xfe, 0xcc};
    EXPECT_TRUE(jumps_to_itself(itself + 1));
    EXPECT_FALSE(jumps_to_itself(itself));  // not yet there
    const std::uint8_t over_a_nop[] = {0x90, 0xeb, 0xfd, 0xcc};
    EXPECT_TRUE(jumps_to_itself(over_a_nop));
    EXPECT_TRUE(jumps_to_itself(over_a_nop + 1));
    const std::uint8_t far[] = {0xe9, 0xfb, 0xff, 0xff, 0xff};
    EXPECT_TRUE(jumps_to_itself(far));
    const std::uint8_t forwards[] = {0xeb, 0x00, 0x90, 0xeb, 0xfe};
    EXPECT_FALSE(jumps_to_itself(forwards));
    const std::uint8_t with_work[] = {0xff, 0xc0, 0xeb, 0xfc, 0xcc};  // inc %eax; jmp to it
    EXPECT_FALSE(jumps_to_itself(with_work + 2));
#endif
}

}  // namespace
}  // namespace qduino::board::sim::testing::sim_spin_test
