// The paper's three ways to make a 10 kHz pulse train (Cheng, West, Ye, RTAS 2017, §III.C and §V),
// on the project's own sketch (sketches/pulse_train) in the simulator: one machine and one load,
// three configurations.
//
//                    mean frequency in kHz          idle     under load
//   QduinoMC         own core, interrupts and       9.569    9.569        (the paper's figures)
//                    tick routed away
//   Qduino           one core for all, budgets,     9.009    8.236
//                    I/O VCPUs
//   Linux            plain threads: sleep and       7.91     6.42
//                    wake, bottom halves above all
//
// The test asserts the order and the shape (kShapeTolerance), and not a machine's timing: the costs
// below are a model, each with its source. The idle column fixes three of them, the loaded one two.
// The simulator's own contribution: this one set of costs gives all six figures, and the load does
// not show at all in the first line.
#include <cstdio>

#include "arduino/core/digital_io.h"
#include "arduino/core/releases.h"
#include "arduino/core/timing.h"
#include "board/board.h"
#include "tests/scenario/guarantee/sketch_bench.h"

namespace qduino::guarantee {
namespace {

enum class Way { qduino_mc, qduino, plain_threads };

constexpr Nanoseconds kLength = 5s;
constexpr double kShapeTolerance = 0.04;
constexpr board::PinId kPulsePin{6};

// ---- the machine --------------------------------------------------------------------------------

/// digitalWrite(): 100 µs of relative waiting and two of these make 104.5 µs, the paper's 9.569
/// kHz.
constexpr Nanoseconds kPinWrite = 2250ns;
/// From the instant that a sleeper asked for to its first instruction: the timer's slack and the
/// way out of idle, then the switch to it. Together what a pulse of Linux idle takes (126.4 µs)
/// beyond the 104.5 above.
constexpr Nanoseconds kWakeLatency = 14us;
constexpr Nanoseconds kContextSwitch = 8us;
/// The scheduling tick of 250 Hz: some microseconds on any of the boards in question.
constexpr Nanoseconds kTick = 4ms;
constexpr Nanoseconds kTickCost = 3us;
/// What the loop of the shared core may take: 94 of 100 ms (9.009 of 9.569).
constexpr Nanoseconds kSharedBudget = 94ms, kSharedPeriod = 100ms;
/// What its bottom halves may, above it: 14 %, and under load they do (8.236 of 9.569 is left). The
/// paper's own budgets for these two are not known here; that both together are more than the core
/// is why the load is seen at all.
constexpr Nanoseconds kBottomBudget = 1400us, kBottomPeriod = 10ms;

/// Top half: acknowledge the device, queue the work: some microseconds on any of the boards in
/// question. A spin to an instant does not see those that fall within it.
constexpr Nanoseconds kTopHalf = 5us;
/// Bottom half: the network stack up to the socket, the end of a disk transfer. Where nothing
/// bounds it, 8400 of both halves a second are 38 % of the core, above every thread: the 19 % by
/// which the load lowers Linux.
constexpr Nanoseconds kBottomHalf = 40us;
constexpr double kNicIdleHz = 20, kDiskIdleHz = 5;  // broadcasts, the journal
// Files come in over the network, and go to disk.
constexpr double kNicLoadHz = 8000, kDiskLoadHz = 400;

SimConfig machine(Way way, bool load) {
    SimConfig config;
    config.cores = way == Way::qduino_mc ? 2 : 1;
    config.costs[board::sim::ApiCall::pin_write] = kPinWrite;
    config.costs.context_switch = kContextSwitch;
    config.wake_latency = kWakeLatency;
    // Neither Quest's nor Linux's VCPU clock stops for a top half.
    config.charge_interrupts_to_victim = true;
    config.tick_period = kTick;
    config.tick_cost = kTickCost;
    const auto add = [&](board::DeviceClass device, double rate_hz) {
        config.interrupts.push_back({.device = device,
                                     .rate_hz = rate_hz,
                                     .arrival = board::sim::Arrival::poisson,
                                     // The train's, until they are routed away.
                                     .core = config.cores - 1,
                                     .top_half = kTopHalf,
                                     .bottom_half = kBottomHalf});
    };
    add(board::DeviceClass::nic, load ? kNicLoadHz : kNicIdleHz);
    add(board::DeviceClass::disk, load ? kDiskLoadHz : kDiskIdleHz);
    return config;
}

/// Counts the pulses and keeps the longest time between two.
class Train final : public board::Peripherals {
  public:
    void pin_written(Instant now, board::PinId pin, board::Level level) override {
        if (pin != kPulsePin || level == board::Level::low) return;
        if (pulses_++ > 0) longest_ = std::max(longest_, now - last_);
        last_ = now;
    }
    void pwm_written(Instant, board::PinId, double) override {}
    board::Level pin_level(Instant, board::PinId) override { return board::Level::low; }
    double analog_level(Instant, board::PinId) override { return 0; }
    Result<void> i2c_transfer(Instant, board::I2cBus, board::I2cAddress, std::span<const std::uint8_t>,
                              std::span<std::uint8_t>) override {
        return {};
    }
    Result<void> spi_transfer(Instant, board::SpiBus, board::SpiSettings, std::span<std::uint8_t>) override {
        return {};
    }
    [[nodiscard]] double mean_khz() const { return static_cast<double>(pulses_) / to_seconds(kLength) / 1e3; }
    [[nodiscard]] Nanoseconds longest() const { return longest_; }

  private:
    std::uint64_t pulses_ = 0;
    Instant last_ = kEpoch;
    Nanoseconds longest_{};
};

// ---- the configurations -------------------------------------------------------------------------

/// Listing 1: the same pulses from a plain thread, which sleeps where the sketch spins.
void listing_1() {
    delayUntil(timeNow() + 100us);
    digitalWrite(kPulsePin.number, HIGH);
    digitalWrite(kPulsePin.number, LOW);
}

/// Another thread of the program, of the length and share of the paper's other loops.
void other_work(SketchBench& sketch) {
    sketch.board().compute(10ms);
    waitForNextPeriod();
}

Result<void> begin(SketchBench& sketch, Way way, bool load, bool enforce_admission) {
    const runtime::SketchTable& pulse_train = runtime::sketch_table();
    if (way == Way::qduino_mc) return sketch.begin(pulse_train, machine(way, load));
    if (way == Way::qduino) {
        sketch.set_setup([] {
            pinMode(kPulsePin.number, OUTPUT);
            auto& runtime = *runtime::Runtime::current();
            EXPECT_TRUE(
                runtime.interrupts_vcpu(board::DeviceClass::all, kBottomBudget, kBottomPeriod, 0).ok());
        });
        sketch.add_loop(1, kSharedBudget, kSharedPeriod, 0, pulse_train.loops[0].body);
    } else {
        sketch.set_setup([] { pinMode(kPulsePin.number, OUTPUT); });
        // No budget that it could spend, and, sleeping most of the time, first in line when it
        // wakes, as a fair scheduler has it.
        sketch.add_loop(1, 99ms, 100ms, 0, &listing_1);
        sketch.add_loop(2, 20ms, 200ms, 0, [&sketch] { other_work(sketch); });
    }
    return sketch.begin(machine(way, load), {.enforce_admission = enforce_admission});
}

struct Measured {
    double mean_khz = 0;
    Nanoseconds longest{};
};

Measured measure(Way way, bool load) {
    Train train;
    SketchBench sketch(train);
    const Result<void> begun = begin(sketch, way, load, false);
    EXPECT_TRUE(begun) << (begun ? "" : begun.error().message.view());
    sketch.run(kLength);
    return {train.mean_khz(), train.longest()};
}

// ---- what is asserted ---------------------------------------------------------------------------

TEST(ThePaper, ItsPulseTrainsComeInItsOrderAndShape) {
    const Measured own = measure(Way::qduino_mc, false), own_loaded = measure(Way::qduino_mc, true);
    const Measured shared = measure(Way::qduino, false), shared_loaded = measure(Way::qduino, true);
    const Measured plain = measure(Way::plain_threads, false),
                   plain_loaded = measure(Way::plain_threads, true);

    std::printf("kHz idle, under load: QduinoMC %.3f %.3f, Qduino %.3f %.3f, plain threads %.3f %.3f\n",
                own.mean_khz, own_loaded.mean_khz, shared.mean_khz, shared_loaded.mean_khz, plain.mean_khz,
                plain_loaded.mean_khz);

    EXPECT_GT(own.mean_khz, shared.mean_khz);
    EXPECT_GT(shared.mean_khz, shared_loaded.mean_khz);
    EXPECT_GT(shared_loaded.mean_khz, plain.mean_khz);
    EXPECT_GT(plain.mean_khz, plain_loaded.mean_khz);

    const auto near = [](double measured, double paper) {
        EXPECT_NEAR(measured, paper, kShapeTolerance * paper);
    };
    near(own.mean_khz, 9.569);
    near(shared.mean_khz, 9.009);
    near(shared_loaded.mean_khz, 8.236);
    near(plain.mean_khz, 7.91);
    near(plain_loaded.mean_khz, 6.42);
    // The load is not seen where the train has its core: not in the mean, nor in a single pulse.
    EXPECT_EQ(own_loaded.mean_khz, own.mean_khz);
    EXPECT_EQ(own_loaded.longest, own.longest);
    EXPECT_EQ(own.longest, 100us + 2 * kPinWrite);
}

TEST(ThePaper, PulsesOfASharedCoreArePushedApartByLoadAndBudgetThoseOfAnOwnedOneAreNot) {
    const Nanoseconds own = measure(Way::qduino_mc, true).longest;
    const Nanoseconds shared = measure(Way::qduino, true).longest;
    const Nanoseconds plain = measure(Way::plain_threads, true).longest;
    EXPECT_GT(shared, own + 1ms);  // throttled
    EXPECT_GT(plain, own + 100us);
}

TEST(ThePaper, OurAdmissionRefusesTheSharedCoreUnderThatLoadAndNamesTheInterrupts) {
    {
        SketchBench sketch;
        EXPECT_TRUE(begin(sketch, Way::qduino_mc, true, true).ok());
    }
    SketchBench sketch;
    ASSERT_FALSE(begin(sketch, Way::qduino, true, true).ok());
    EXPECT_NE(sketch.runtime().explanation().view().find("interrupts"), std::string_view::npos)
        << sketch.runtime().explanation().view();
}

}  // namespace
}  // namespace qduino::guarantee
