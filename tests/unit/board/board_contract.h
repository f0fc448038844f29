// The contract suite: what board.h promises, asked of every board in the same words.
//
// A board joins with a bench, a class that has
//     Board& board();                      with ContractWires connected
//     const ContractWires& finish();       the board has stopped: all that it wrote has arrived
//     int current_core();                  of the calling VCPU
// and one line: INSTANTIATE_TYPED_TEST_SUITE_P(Name, BoardContract, Bench);
//
// The same tests run in virtual and in real time, so nothing here asserts how long anything took.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <functional>
#include <limits>
#include <list>
#include <vector>

#include "board/board.h"
#include "tests/unit/board/contract_wires.h"

namespace qduino::board::contract {

template <typename Bench>
class BoardContract : public ::testing::Test {
  protected:
    using Body = std::function<void()>;

    Board& board() { return bench_.board(); }

    void add_loop(VcpuId id, int core, Body body, Nanoseconds budget = 20ms, Nanoseconds period = 100ms) {
        bodies_.push_back(std::move(body));
        VcpuSpec spec;
        spec.id = id;
        spec.budget = budget;
        spec.period = period;
        spec.core = core;
        spec.entry = [](void* context) { (*static_cast<Body*>(context))(); };
        spec.context = &bodies_.back();
        specs_.push_back(spec);
    }
    void add_io(VcpuId id, int core) {
        VcpuSpec spec;
        spec.id = id;
        spec.kind = VcpuKind::io;
        spec.budget = 10ms;
        spec.period = 100ms;
        spec.core = core;
        specs_.push_back(spec);
    }
    Result<void> start() { return board().start(specs_); }

    /// One loop that does `body`, then stops the board; returns what the wires saw.
    const ContractWires& run_one(Body body) {
        add_loop(1, 0, [this, body] {
            body();
            board().request_stop();
        });
        const Result<void> started = start();
        EXPECT_TRUE(started) << (started ? "" : started.error().message.view());
        board().run(kForever);
        return bench_.finish();
    }

    /// Asks until it is so; a board whose wires are in another process answers late. False after 5
    /// s.
    bool eventually(const std::function<bool()>& condition) {
        for (int tries = 0; tries < 5000; ++tries) {
            if (condition()) return true;
            board().sleep_until(board().now() + 1ms);
        }
        return condition();
    }

    Bench bench_;
    std::list<Body> bodies_;
    std::vector<VcpuSpec> specs_;
};

TYPED_TEST_SUITE_P(BoardContract);

// ---- time ---------------------------------------------------------------------------------------

TYPED_TEST_P(BoardContract, BusyUntilAndSleepUntilAreNeverEarly) {
    this->run_one([this] {
        auto& board = this->board();
        for (int i = 0; i < 200; ++i) {
            // Some are in the past.
            const Instant target = board.now() + Nanoseconds{i * 997 - 20'000};
            i % 2 == 0 ? board.busy_until(target) : board.sleep_until(target);
            ASSERT_GE(board.now(), target) << i;
        }
    });
}

TYPED_TEST_P(BoardContract, BusyForIsNeverShort) {
    this->run_one([this] {
        auto& board = this->board();
        for (const int length_ns : {-5, 0, 1, 40, 1000, 100'000}) {
            for (int i = 0; i < 100; ++i) {
                const Instant start = board.now();
                board.busy_for(Nanoseconds{length_ns});
                ASSERT_GE((board.now() - start).count(), length_ns) << i;
            }
        }
    });
}

TYPED_TEST_P(BoardContract, TimeNeverRunsBackwardsAndIsOneForAllVcpus) {
    auto& board = this->board();
    const int cores = board.core_count();
    std::atomic<std::int64_t> latest{to_ns(board.now())};
    std::atomic<int> running{2};
    for (VcpuId id = 1; id <= 2; ++id) {
        this->add_loop(id, (id - 1) % cores, [&] {
            for (int i = 0; i < 500; ++i) {
                const std::int64_t before = latest.load();  // handed out already, to whomever
                const std::int64_t mine = to_ns(board.now());
                ASSERT_GE(mine, before);
                std::int64_t seen = before;
                while (seen < mine && !latest.compare_exchange_weak(seen, mine)) {
                }
                board.busy_until(instant_from_ns(mine) + 3us);
            }
            if (--running == 0) board.request_stop();
        });
    }
    ASSERT_TRUE(this->start());
    board.run(kForever);
    EXPECT_GE(to_ns(board.now()), latest.load());
}

// ---- entries ------------------------------------------------------------------------------------

TYPED_TEST_P(BoardContract, EveryEntryRunsOnceOnItsVcpuAndCore) {
    auto& board = this->board();
    const int cores = board.core_count();
    EXPECT_EQ(board.current_vcpu(), kNoVcpu);
    constexpr VcpuId kLoops = 5;
    std::array<std::atomic<int>, kLoops + 1> runs{};
    std::atomic<int> left{kLoops};
    for (VcpuId id = 1; id <= kLoops; ++id) {
        this->add_loop(
            id, id % cores,
            [&, id] {
                ++runs[id];
                EXPECT_EQ(board.current_vcpu(), id);
                EXPECT_EQ(this->bench_.current_core(), id % cores);
                board.sleep_until(board.now() + 1ms);
                EXPECT_EQ(board.current_vcpu(), id);
                EXPECT_EQ(this->bench_.current_core(), id % cores);
                if (--left == 0) board.request_stop();
            },
            5ms, 100ms + 10ms * id);
    }
    ASSERT_TRUE(this->start());
    board.run(kForever);
    for (VcpuId id = 1; id <= kLoops; ++id) EXPECT_EQ(runs[id], 1) << int{id};
    EXPECT_EQ(board.current_vcpu(), kNoVcpu);
}

TYPED_TEST_P(BoardContract, RunReturnsAtUntilAndGoesOnWhenCalledAgain) {
    auto& board = this->board();
    std::atomic<int> turns{0};
    this->add_loop(1, 0, [&] {
        while (!board.stop_requested()) {
            ++turns;
            board.sleep_until(board.now() + 1ms);
        }
    });
    ASSERT_TRUE(this->start());
    int turns_before = 0;
    for (int i = 0; i < 5; ++i) {
        // A busy machine may leave a loop no time for a while.
        const Instant give_up = board.now() + 30s;
        do {
            const Instant until = board.now() + 5ms;
            board.run(until);
            EXPECT_GE(board.now(), until);
            EXPECT_FALSE(board.stop_requested());
        } while (turns == turns_before && board.now() < give_up);
        ASSERT_GT(turns, turns_before) << "the loop does not go on";
        turns_before = turns;
    }
    board.request_stop();
    EXPECT_TRUE(board.stop_requested());
    board.run(kForever);
    EXPECT_GE(turns, 2);
}

TYPED_TEST_P(BoardContract, AStopIsSeenByEveryLoopAndRunWaitsForAll) {
    auto& board = this->board();
    std::atomic<int> ended{0};
    for (VcpuId id = 1; id <= 3; ++id) {
        this->add_loop(
            id, id % board.core_count(),
            [&, id] {
                while (!board.stop_requested()) board.sleep_until(board.now() + 1ms);
                board.sleep_until(board.now() + id * 2ms);  // run() must wait for the slowest
                ++ended;
            },
            5ms, 100ms);
    }
    this->add_loop(
        4, 0, [&] { board.request_stop(); }, 5ms, 50ms);
    EXPECT_FALSE(board.stop_requested());
    ASSERT_TRUE(this->start());
    board.run(kForever);
    EXPECT_EQ(ended, 3);
}

TYPED_TEST_P(BoardContract, BadSpecsAreRefusedAndNothingRuns) {
    auto& board = this->board();
    std::atomic<int> runs{0};
    const auto refused = [&](auto change) {
        this->specs_.clear();
        this->add_loop(1, 0, [&] { ++runs; });
        this->add_loop(2, 0, [&] { ++runs; });
        change(this->specs_.back());
        const Result<void> started = this->start();
        return !started && !started.error().message.empty();
    };
    EXPECT_TRUE(refused([&](VcpuSpec& spec) { spec.core = board.core_count(); }));
    EXPECT_TRUE(refused([](VcpuSpec& spec) { spec.core = -1; }));
    EXPECT_TRUE(refused([](VcpuSpec& spec) { spec.id = 1; }));
    EXPECT_TRUE(refused([](VcpuSpec& spec) { spec.id = kNoVcpu; }));
    EXPECT_TRUE(refused([](VcpuSpec& spec) { spec.budget = Nanoseconds{0}; }));
    EXPECT_TRUE(refused([](VcpuSpec& spec) { spec.budget = spec.period + 1ns; }));
    EXPECT_TRUE(refused([](VcpuSpec& spec) { spec.entry = nullptr; }));
    EXPECT_EQ(runs, 0);
}

TYPED_TEST_P(BoardContract, TheGuaranteeNamesEveryLoop) {
    auto& board = this->board();
    this->add_loop(1, 0, [] {});
    this->add_loop(
        7, 0, [&] { board.request_stop(); }, 10ms, 200ms);
    ASSERT_TRUE(this->start());
    board.run(kForever);
    const GuaranteeReport report = board.guarantee();
    ASSERT_EQ(report.loops.size(), 2u);
    EXPECT_EQ(report.loops[0].id, 1);
    EXPECT_EQ(report.loops[1].id, 7);
    EXPECT_EQ(report.loops[1].budget, Nanoseconds{10ms});
    EXPECT_EQ(report.loops[1].period, Nanoseconds{200ms});
    // Never silent: what is not enforced has its reason.
    for (const LoopGuarantee& loop : report.loops) {
        EXPECT_TRUE((loop.priority_enforced && loop.budget_enforced) || !loop.shortfall.empty());
    }
}

// ---- pins ---------------------------------------------------------------------------------------

TYPED_TEST_P(BoardContract, WritesReachTheWiresInOrderAndAtTheirTime) {
    auto& board = this->board();
    std::vector<Instant> before, after;
    const ContractWires& wires = this->run_one([&] {
        ASSERT_TRUE(board.pin_mode(kLamp, PinMode::output));
        for (int i = 0; i < 100; ++i) {
            before.push_back(board.now());
            board.pin_write(kLamp, i % 3 == 0 ? Level::high : Level::low);
            after.push_back(board.now());
            board.busy_until(board.now() + 2us);
        }
    });
    std::vector<ContractWires::PinWrite> lamp;
    for (const auto& write : wires.pin_writes) {
        if (write.pin == kLamp) lamp.push_back(write);
    }
    ASSERT_GE(lamp.size(), 100u);  // becoming an output may write its level once
    lamp.erase(lamp.begin(), lamp.end() - 100);
    for (std::size_t i = 0; i < 100; ++i) {
        EXPECT_EQ(lamp[i].level, i % 3 == 0 ? Level::high : Level::low) << i;
        EXPECT_GE(lamp[i].time, before[i]) << i;
        EXPECT_LE(lamp[i].time, after[i]) << i;
    }
}

TYPED_TEST_P(BoardContract, PinsThatAreWrittenTogetherAreAllWritten) {
    auto& board = this->board();
    const ContractWires& wires = this->run_one([&] {
        for (const PinId pin : {kLamp, kDriver}) ASSERT_TRUE(board.pin_mode(pin, PinMode::output));
        for (int i = 0; i < 50; ++i) {
            board.pins_write(std::array{kLamp, kDriver}, i % 2 == 0 ? Level::high : Level::low);
            board.busy_until(board.now() + 2us);
        }
    });
    for (const PinId pin : {kLamp, kDriver}) {
        std::vector<Level> levels;
        for (const auto& write : wires.pin_writes)
            if (write.pin == pin) levels.push_back(write.level);
        ASSERT_GE(levels.size(), 50u);  // becoming an output may write its level once
        levels.erase(levels.begin(), levels.end() - 50);
        for (std::size_t i = 0; i < 50; ++i)
            EXPECT_EQ(levels[i], i % 2 == 0 ? Level::high : Level::low) << pin.number << " " << i;
    }
}

TYPED_TEST_P(BoardContract, AnOutputReadsBackWhatWasWritten) {
    auto& board = this->board();
    this->run_one([&] {
        ASSERT_TRUE(board.pin_mode(kLamp, PinMode::output));
        for (int i = 0; i < 20; ++i) {
            const Level level = i % 2 == 0 ? Level::high : Level::low;
            board.pin_write(kLamp, level);
            EXPECT_EQ(board.pin_read(kLamp), level);
        }
    });
}

TYPED_TEST_P(BoardContract, AnInputReadsItsWire) {
    auto& board = this->board();
    this->run_one([&] {
        ASSERT_TRUE(board.pin_mode(kSensor, PinMode::input));
        ASSERT_TRUE(board.pin_mode(kLoose, PinMode::input));
        ASSERT_TRUE(board.pin_mode(kDriver, PinMode::output));
        EXPECT_EQ(board.pin_read(kSensor), Level::low);
        for (int i = 0; i < 6; ++i) {
            const Level level = i % 2 == 0 ? Level::high : Level::low;
            board.pin_write(kDriver, level);
            EXPECT_TRUE(this->eventually([&] { return board.pin_read(kSensor) == level; })) << i;
            EXPECT_EQ(board.pin_read(kLoose), Level::low);
        }
    });
}

TYPED_TEST_P(BoardContract, PinsStartAsInputsAndDriveNothing) {
    auto& board = this->board();
    const ContractWires& wires = this->run_one([&] {
        board.pin_write(kDriver, Level::high);
        ASSERT_TRUE(board.pin_mode(kSensor, PinMode::input));
        board.sleep_until(board.now() + 5ms);
        EXPECT_EQ(board.pin_read(kSensor), Level::low);
    });
    EXPECT_TRUE(wires.levels_of(kDriver).empty());
}

TYPED_TEST_P(BoardContract, ALevelWrittenBeforeTheModeIsTheFirstThatIsDriven) {
    auto& board = this->board();
    const ContractWires& wires = this->run_one([&] {
        ASSERT_TRUE(board.safe_state(kLamp, Level::high));
        board.pin_write(kLamp, Level::high);
        ASSERT_TRUE(board.pin_mode(kLamp, PinMode::output));
        EXPECT_EQ(board.pin_read(kLamp), Level::high);
        // Which is no write: the latch is low still.
        ASSERT_TRUE(board.pin_mode(kDriver, PinMode::input_pullup));
        ASSERT_TRUE(board.pin_mode(kDriver, PinMode::output));
        EXPECT_EQ(board.pin_read(kDriver), Level::low);
        board.pin_write(kHeater, Level::high);
        board.pin_write(kHeater, Level::low);  // the last counts
        ASSERT_TRUE(board.pin_mode(kHeater, PinMode::output_open_drain));
    });
    for (const auto& [pin, level] :
         {std::pair{kLamp, Level::high}, std::pair{kDriver, Level::low}, std::pair{kHeater, Level::low}}) {
        const std::vector<Level> levels = wires.levels_of(pin);
        EXPECT_FALSE(levels.empty()) << pin.number;
        EXPECT_EQ(std::count(levels.begin(), levels.end(), level), std::ssize(levels)) << pin.number;
    }
}

TYPED_TEST_P(BoardContract, PinsThatAreNotThereAreRefused) {
    auto& board = this->board();
    constexpr PinId kNone{kPinCount};
    const ContractWires& wires = this->run_one([&] {
        EXPECT_FALSE(board.pin_mode(kNone, PinMode::output));
        board.pin_write(kNone, Level::high);
        EXPECT_EQ(board.pin_read(kNone), Level::low);
        EXPECT_FALSE(board.pwm_write(kNone, 0.5));
        EXPECT_FALSE(board.analog_read(kNone));
        EXPECT_FALSE(board.safe_state(kNone, Level::low));
        EXPECT_FALSE(board.attach_edge(
            kNone, Edge::both, [](void*) {}, nullptr, kFirstIoVcpu));
        board.detach_edge(kNone);
    });
    EXPECT_TRUE(wires.pin_writes.empty());
}

TYPED_TEST_P(BoardContract, PwmArrivesAsItsDutyAndOnlyWithinBounds) {
    auto& board = this->board();
    const ContractWires& wires = this->run_one([&] {
        ASSERT_TRUE(board.pin_mode(kHeater, PinMode::output));
        EXPECT_TRUE(board.pwm_write(kHeater, 0.25));
        EXPECT_TRUE(board.pwm_write(kHeater, 1.0));
        EXPECT_TRUE(board.pwm_write(kHeater, 0.0));
        EXPECT_FALSE(board.pwm_write(kHeater, -0.01));
        EXPECT_FALSE(board.pwm_write(kHeater, 1.01));
        EXPECT_FALSE(board.pwm_write(kHeater, std::numeric_limits<double>::quiet_NaN()));
    });
    ASSERT_EQ(wires.pwm_writes.size(), 3u);
    EXPECT_DOUBLE_EQ(wires.pwm_writes[0].duty, 0.25);
    EXPECT_DOUBLE_EQ(wires.pwm_writes[1].duty, 1.0);
    EXPECT_DOUBLE_EQ(wires.pwm_writes[2].duty, 0.0);
    for (const auto& write : wires.pwm_writes) EXPECT_EQ(write.pin, kHeater);
}

TYPED_TEST_P(BoardContract, APwmHasThePeriodThatItIsGiven) {
    auto& board = this->board();
    const ContractWires& wires = this->run_one([&] {
        ASSERT_TRUE(board.pin_mode(kHeater, PinMode::output));
        EXPECT_TRUE(board.pwm_period(kHeater, 20ms));
        EXPECT_TRUE(board.pwm_write(kHeater, 0.075));
        EXPECT_TRUE(board.pwm_period(kHeater, kPwmPeriodMin));
        EXPECT_TRUE(board.pwm_period(kHeater, kPwmPeriodMax));
        EXPECT_TRUE(board.pwm_period(kHeater, Nanoseconds{0}));
        for (const Nanoseconds wrong : {Nanoseconds{-1}, kPwmPeriodMin - 1ns, kPwmPeriodMax + 1ns})
            EXPECT_EQ(board.pwm_period(kHeater, wrong).error().code, ErrorCode::invalid_argument);
        EXPECT_FALSE(board.pwm_period(PinId{kPinCount}, 20ms));
    });
    ASSERT_EQ(wires.pwm_periods.size(), 4u);
    EXPECT_EQ(wires.pwm_periods[0].period, Nanoseconds{20ms});
    EXPECT_EQ(wires.pwm_periods[1].period, kPwmPeriodMin);
    EXPECT_EQ(wires.pwm_periods[2].period, kPwmPeriodMax);
    EXPECT_EQ(wires.pwm_periods[3].period, Nanoseconds{0});
    ASSERT_EQ(wires.pwm_writes.size(), 1u);  // what is wired to it sees the duty as ever
    EXPECT_FLOAT_EQ(static_cast<float>(wires.pwm_writes[0].duty), 0.075F);
    EXPECT_LE(wires.pwm_periods[0].time, wires.pwm_writes[0].time);
    EXPECT_LE(wires.pwm_writes[0].time, wires.pwm_periods[1].time);
}

// ---- buses --------------------------------------------------------------------------------------

TYPED_TEST_P(BoardContract, I2cCarriesExactBytesBothWays) {
    auto& board = this->board();
    const ContractWires& wires = this->run_one([&] {
        const std::array<std::uint8_t, 3> out{0x84, 0x00, 0xff};
        std::array<std::uint8_t, 4> in{};
        ASSERT_TRUE(board.i2c_transfer(kI2c, kChip, out, in));
        EXPECT_EQ(in, (std::array<std::uint8_t, 4>{0x7b, 0xff, 0x00, 0x7b}));
        ASSERT_TRUE(board.i2c_transfer(kI2c, kChip, out, std::span<std::uint8_t>{}));
        ASSERT_TRUE(board.i2c_transfer(kI2c, kChip, std::span<const std::uint8_t>{}, in));
    });
    ASSERT_EQ(wires.i2c_transfers.size(), 3u);
    EXPECT_EQ(wires.i2c_transfers[0].address.value, kChip.value);
    EXPECT_EQ(wires.i2c_transfers[0].out, (std::vector<std::uint8_t>{0x84, 0x00, 0xff}));
    EXPECT_EQ(wires.i2c_transfers[0].in, 4u);
    EXPECT_EQ(wires.i2c_transfers[1].in, 0u);
    EXPECT_TRUE(wires.i2c_transfers[2].out.empty());
}

TYPED_TEST_P(BoardContract, AnAddressWithoutAChipTimesOut) {
    auto& board = this->board();
    this->run_one([&] {
        std::array<std::uint8_t, 2> in{0xaa, 0xaa};
        const Result<void> read = board.i2c_transfer(kI2c, kNobody, std::span<const std::uint8_t>{}, in);
        ASSERT_FALSE(read);
        EXPECT_EQ(read.error().code, ErrorCode::timed_out);
    });
}

TYPED_TEST_P(BoardContract, SpiIsFullDuplexInPlace) {
    auto& board = this->board();
    const ContractWires& wires = this->run_one([&] {
        std::array<std::uint8_t, 3> data{1, 2, 0xff};
        ASSERT_TRUE(board.spi_transfer(
            kSpi, {.clock_hz = 1'000'000, .mode = 3, .least_significant_first = true}, data));
        EXPECT_EQ(data, (std::array<std::uint8_t, 3>{2, 3, 0}));
    });
    ASSERT_EQ(wires.spi_transfers.size(), 1u);
    EXPECT_EQ(wires.spi_transfers[0].data, (std::vector<std::uint8_t>{1, 2, 0xff}));
    EXPECT_EQ(wires.spi_transfers[0].settings.clock_hz, 1'000'000u);
    EXPECT_EQ(wires.spi_transfers[0].settings.mode, 3);
    EXPECT_TRUE(wires.spi_transfers[0].settings.least_significant_first);
}

TYPED_TEST_P(BoardContract, AnAnalogPinReadsItsVoltage) {
    auto& board = this->board();
    this->run_one([&] {
        const Result<double> level = board.analog_read(kVoltage);
        ASSERT_TRUE(level);
        EXPECT_DOUBLE_EQ(level.value(), kVoltageLevel);
    });
}

TYPED_TEST_P(BoardContract, AChipTemperatureIsInDegreesOrRefusedWithAReason) {
    const Result<double> celsius = this->board().chip_temperature();
    if (celsius) {
        EXPECT_GT(celsius.value(), -60);
        EXPECT_LT(celsius.value(), 150);
    } else {
        EXPECT_FALSE(celsius.error().message.empty());
    }
}

// ---- edges --------------------------------------------------------------------------------------

TYPED_TEST_P(BoardContract, EdgesRunTheirHandlerOnItsIoVcpu) {
    auto& board = this->board();
    struct Seen {
        TypeParam* bench = nullptr;
        std::atomic<int> rising{0};
        std::atomic<int> wrong_vcpu{0};
    } seen;
    seen.bench = &this->bench_;
    this->add_io(40, board.core_count() - 1);
    this->run_one([&] {
        const auto count = [](void* context) {
            auto& s = *static_cast<Seen*>(context);
            if (s.bench->board().current_vcpu() != 40) ++s.wrong_vcpu;
            ++s.rising;
        };
        ASSERT_TRUE(board.pin_mode(kDriver, PinMode::output));
        ASSERT_TRUE(board.pin_mode(kSensor, PinMode::input));
        ASSERT_TRUE(board.attach_edge(kSensor, Edge::rising, count, &seen, 40));
        for (int i = 1; i <= 5; ++i) {
            board.pin_write(kDriver, Level::high);
            ASSERT_TRUE(this->eventually([&] { return seen.rising == i; })) << i;
            board.pin_write(kDriver, Level::high);  // no edge: it is high already
            board.pin_write(kDriver, Level::low);
            ASSERT_TRUE(this->eventually([&] { return board.pin_read(kSensor) == Level::low; })) << i;
            // A board that polls its inputs may miss a shorter pulse.
            board.sleep_until(board.now() + 1ms);
        }
        EXPECT_EQ(seen.rising, 5);  // and none for the falling ones
        board.detach_edge(kSensor);
        board.pin_write(kDriver, Level::high);
        ASSERT_TRUE(this->eventually([&] { return board.pin_read(kSensor) == Level::high; }));
        board.sleep_until(board.now() + 5ms);
        EXPECT_EQ(seen.rising, 5);
    });
    EXPECT_EQ(seen.wrong_vcpu, 0);
}

TYPED_TEST_P(BoardContract, AnEdgeNeedsAHandlerAndAnIoVcpu) {
    auto& board = this->board();
    this->run_one([&] {
        ASSERT_TRUE(board.pin_mode(kSensor, PinMode::input));
        EXPECT_FALSE(board.attach_edge(kSensor, Edge::both, nullptr, nullptr, 40));
        EXPECT_FALSE(board.attach_edge(
            kSensor, Edge::both, [](void*) {}, nullptr, 1));
    });
}

TYPED_TEST_P(BoardContract, AnIoVcpuThatRunsTakesAnotherBudget) {
    auto& board = this->board();
    std::atomic<int> edges{0};
    this->add_io(40, 0);
    this->run_one([&] {
        ASSERT_TRUE(board.pin_mode(kDriver, PinMode::output));
        ASSERT_TRUE(board.pin_mode(kSensor, PinMode::input));
        ASSERT_TRUE(board.attach_edge(
            kSensor, Edge::both, [](void* count) { ++*static_cast<std::atomic<int>*>(count); }, &edges, 40));
        for (int i = 1; i <= 4; ++i) {  // more, and less
            const Nanoseconds budget = i % 2 == 0 ? Nanoseconds{1ms} : Nanoseconds{20ms};
            ASSERT_TRUE(board.change_io(40, {budget, 50ms}));
            board.pin_write(kDriver, i % 2 == 0 ? Level::low : Level::high);
            ASSERT_TRUE(this->eventually([&] { return edges == i; })) << i;
        }
        EXPECT_FALSE(board.change_io(1, {1ms, 50ms})) << "a loop's budget is its declaration's";
        EXPECT_FALSE(board.change_io(41, {1ms, 50ms}));
    });
    const GuaranteeReport report = board.guarantee();
    const auto* const io = std::ranges::find(report.loops, VcpuId{40}, &LoopGuarantee::id);
    ASSERT_NE(io, report.loops.end());
    EXPECT_EQ(io->budget, Nanoseconds{1ms});
    EXPECT_EQ(io->period, Nanoseconds{50ms});
}

// ---- locks --------------------------------------------------------------------------------------

TYPED_TEST_P(BoardContract, ALockIsHeldByOneAtATime) {
    auto& board = this->board();
    LockWord lock;
    constexpr int kLoops = 4, kTurns = 200;
    std::atomic<int> inside{0}, together{0}, left{kLoops};
    std::atomic<int> counted{0};  // not by an atomic addition, but by whoever holds the lock
    for (VcpuId id = 1; id <= kLoops; ++id) {
        this->add_loop(
            id, id % board.core_count(),
            [&, id] {
                for (int turn = 0; turn < kTurns; ++turn) {
                    const bool took = turn % 3 == 0 && board.try_lock(lock);
                    if (!took) board.lock(lock);
                    if (++inside != 1) ++together;
                    EXPECT_FALSE(board.try_lock(lock));  // its own neither
                    const int before = counted;
                    board.busy_until(board.now() + Nanoseconds{1000 * id});
                    if (turn % 50 == id) board.sleep_until(board.now() + 100us);
                    counted = before + 1;
                    --inside;
                    board.unlock(lock);
                    board.busy_until(board.now() + 2us);
                }
                if (--left == 0) board.request_stop();
            },
            20ms, 100ms + 10ms * id);
    }
    ASSERT_TRUE(this->start());
    board.run(kForever);
    EXPECT_EQ(together, 0);
    EXPECT_EQ(counted, kLoops * kTurns);
    EXPECT_EQ(lock.value, 0u);
}

TYPED_TEST_P(BoardContract, WritesUnderALockAreSeenInTheOrderOfItsHolders) {
    auto& board = this->board();
    constexpr int kTurns = 3000;
    LockWord lock;
    std::vector<PinId> order;  // under the lock
    order.reserve(2 * kTurns);
    std::atomic<int> left{2};
    for (VcpuId id = 1; id <= 2; ++id) {
        this->add_loop(id, (id - 1) % board.core_count(), [&, pin = id == 1 ? kDriver : kLamp] {
            for (int turn = 0; turn < kTurns; ++turn) {
                board.lock(lock);
                order.push_back(pin);
                board.pin_write(pin, turn % 2 == 0 ? Level::high : Level::low);
                board.unlock(lock);
                board.busy_for(Nanoseconds{turn % 7 * 100});
            }
            if (--left == 0) board.request_stop();
        });
    }
    ASSERT_TRUE(board.pin_mode(kDriver, PinMode::output));
    ASSERT_TRUE(board.pin_mode(kLamp, PinMode::output));
    ASSERT_TRUE(this->start());
    board.run(kForever);
    const auto& writes = this->bench_.finish().pin_writes;
    ASSERT_GE(writes.size(), order.size());  // becoming an output may write a level
    const auto first = writes.end() - static_cast<std::ptrdiff_t>(order.size());
    EXPECT_TRUE(std::equal(order.begin(), order.end(), first,
                           [](PinId pin, const auto& write) { return pin == write.pin; }));
}

TYPED_TEST_P(BoardContract, SetupMayLockToo) {
    auto& board = this->board();
    LockWord lock;
    board.lock(lock);
    EXPECT_FALSE(board.try_lock(lock));
    board.unlock(lock);
    EXPECT_TRUE(board.try_lock(lock));
    board.unlock(lock);
    this->run_one([&] {
        EXPECT_TRUE(board.try_lock(lock));
        board.unlock(lock);
    });
}

TYPED_TEST_P(BoardContract, TheHighWaitsForTheLowsCriticalSectionAlone) {
    auto& board = this->board();
    LockWord lock;
    std::atomic<bool> held{false}, wanted{false};
    std::atomic<int> order{0};
    int low_unlocked = 0, high_locked = 0, mid_done = 0;
    const auto wait_for = [&](const std::atomic<bool>& flag) {
        while (!flag) board.sleep_until(board.now() + 100us);
    };
    this->add_loop(  // low
        1, 0,
        [&] {
            board.lock(lock);
            held = true;
            wait_for(wanted);
            board.busy_until(board.now() + 2ms);
            low_unlocked = ++order;
            board.unlock(lock);
        },
        60ms, 300ms);
    this->add_loop(  // mid: from when high waits, longer than the critical section
        2, 0,
        [&] {
            wait_for(wanted);
            board.busy_until(board.now() + 15ms);
            mid_done = ++order;
        },
        40ms, 200ms);
    this->add_loop(  // high
        3, 0,
        [&] {
            wait_for(held);
            wanted = true;
            board.lock(lock);
            high_locked = ++order;
            board.unlock(lock);
        },
        20ms, 100ms);
    ASSERT_TRUE(this->start());
    const GuaranteeReport report = board.guarantee();
    board.request_stop();  // which none of them asks for
    board.run(kForever);
    EXPECT_EQ(std::minmax({low_unlocked, high_locked, mid_done}), std::pair(1, 3));
    EXPECT_LT(low_unlocked, high_locked);
    if (report.loops[0].priority_enforced) {  // else the system runs them as it likes
        EXPECT_LT(high_locked, mid_done);
    }
}

// ---- safe states --------------------------------------------------------------------------------

TYPED_TEST_P(BoardContract, AStoppedBoardLeavesItsPinsInTheirSafeStates) {
    auto& board = this->board();
    const ContractWires& wires = this->run_one([&] {
        ASSERT_TRUE(board.pin_mode(kLamp, PinMode::output));
        ASSERT_TRUE(board.pin_mode(kDriver, PinMode::output));
        ASSERT_TRUE(board.pin_mode(kHeater, PinMode::output));
        ASSERT_TRUE(board.safe_state(kLamp, Level::low));
        ASSERT_TRUE(board.safe_state(kDriver, Level::high));
        ASSERT_TRUE(board.safe_state(kHeater, Level::low));
        board.pin_write(kLamp, Level::high);
        board.pin_write(kDriver, Level::low);
        const Result<void> heated = board.pwm_write(kHeater, 0.8);
        ASSERT_TRUE(heated || heated.error().code == ErrorCode::unsupported);
    });
    ASSERT_FALSE(wires.levels_of(kLamp).empty());
    EXPECT_EQ(wires.levels_of(kLamp).back(), Level::low);
    ASSERT_FALSE(wires.levels_of(kDriver).empty());
    EXPECT_EQ(wires.levels_of(kDriver).back(), Level::high);
    // A heater on PWM is off when its duty is 0, or when its pin is driven low after the last duty.
    const auto driven = wires.levels_of(kHeater);
    const bool duty_is_off = !wires.pwm_writes.empty() && wires.pwm_writes.back().duty == 0.0;
    EXPECT_TRUE(duty_is_off || (!driven.empty() && driven.back() == Level::low));
}

REGISTER_TYPED_TEST_SUITE_P(
    BoardContract, BusyUntilAndSleepUntilAreNeverEarly, BusyForIsNeverShort,
    TimeNeverRunsBackwardsAndIsOneForAllVcpus, EveryEntryRunsOnceOnItsVcpuAndCore,
    RunReturnsAtUntilAndGoesOnWhenCalledAgain, AStopIsSeenByEveryLoopAndRunWaitsForAll,
    BadSpecsAreRefusedAndNothingRuns, TheGuaranteeNamesEveryLoop, WritesReachTheWiresInOrderAndAtTheirTime,
    PinsThatAreWrittenTogetherAreAllWritten, AnOutputReadsBackWhatWasWritten, AnInputReadsItsWire,
    PinsStartAsInputsAndDriveNothing, ALevelWrittenBeforeTheModeIsTheFirstThatIsDriven,
    PinsThatAreNotThereAreRefused, PwmArrivesAsItsDutyAndOnlyWithinBounds, APwmHasThePeriodThatItIsGiven,
    I2cCarriesExactBytesBothWays, AnAddressWithoutAChipTimesOut, SpiIsFullDuplexInPlace,
    AnAnalogPinReadsItsVoltage, AChipTemperatureIsInDegreesOrRefusedWithAReason,
    EdgesRunTheirHandlerOnItsIoVcpu, AnEdgeNeedsAHandlerAndAnIoVcpu, AnIoVcpuThatRunsTakesAnotherBudget,
    ALockIsHeldByOneAtATime, WritesUnderALockAreSeenInTheOrderOfItsHolders, SetupMayLockToo,
    TheHighWaitsForTheLowsCriticalSectionAlone, AStoppedBoardLeavesItsPinsInTheirSafeStates);

}  // namespace qduino::board::contract
