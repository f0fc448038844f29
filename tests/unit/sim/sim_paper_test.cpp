// The paper's three ways to make a 10 kHz pulse train (Cheng, West, Ye, RTAS 2017, §III and §V), in the simulator: not its figures,
// which are a machine's, but their order and shape.
//
//   QduinoMC       own core, interrupts and tick routed away      fastest; load changes nothing
//   Qduino         one core for all, budgets and I/O VCPUs        below it by what it must leave to others; load costs a little
//   plain threads  sleep and wake, bottom halves above everything slowest; load costs the most
#include <gtest/gtest.h>

#include "sim_fixture.h"

namespace qduino::board::sim::testing {
namespace {

enum class Way { qduino_mc, qduino, plain_threads };

/// Counts rising edges and keeps the longest time between two.
class Train final : public ::qduino::board::Peripherals {
  public:
    void pin_written(Instant now, PinId, Level level) override {
        if (level == Level::low) return;
        if (pulses_++ > 0) longest_ = std::max(longest_, now - last_);
        last_ = now;
    }
    void pwm_written(Instant, PinId, double) override {}
    Level pin_level(Instant, PinId) override { return Level::low; }
    double analog_level(Instant, PinId) override { return 0; }
    Result<void> i2c_transfer(Instant, I2cBus, I2cAddress, std::span<const std::uint8_t>,
                              std::span<std::uint8_t>) override {
        return {};
    }
    Result<void> spi_transfer(Instant, SpiBus, SpiSettings, std::span<std::uint8_t>) override { return {}; }

    [[nodiscard]] double mean_hz(Nanoseconds length) const {
        return static_cast<double>(pulses_) / to_seconds(length);
    }
    [[nodiscard]] Nanoseconds longest() const { return longest_; }

  private:
    std::uint64_t pulses_ = 0;
    Instant last_ = kEpoch;
    Nanoseconds longest_{};
};

struct Measured {
    double mean_hz = 0;
    Nanoseconds longest{};
};

SimConfig machine(Way way, bool load) {
    SimConfig config;
    config.cores = way == Way::qduino_mc ? 2 : 1;
    config.costs[ApiCall::pin_write] =
        2250ns;  // so that a relative delay of 100 us gives the paper's 9.57 kHz
    config.costs.context_switch = way == Way::plain_threads ? Nanoseconds{8us} : Nanoseconds{2us};
    config.charge_interrupts_to_victim = true;  // neither Quest's nor Linux's VCPU clock stops for a top half
    config.tick_period = 4ms;
    config.tick_cost = 3us;
    for (const auto& [device, rate_hz] : {std::pair{DeviceClass::nic, load ? 4000.0 : 20.0},
                                          std::pair{DeviceClass::disk, load ? 400.0 : 5.0}}) {
        config.interrupts.push_back({.device = device,
                                     .rate_hz = rate_hz,
                                     .arrival = Arrival::poisson,
                                     .core = config.cores - 1,
                                     .top_half = 5us,
                                     .bottom_half = 45us});
    }
    return config;
}

Measured measure(Way way, bool load) {
    constexpr Nanoseconds kLength = 5s;
    Train train;
    SimBoard board(machine(way, load), train);
    Program program;
    const auto pulses = [&] {
        EXPECT_TRUE(board.pin_mode(PinId{6}, PinMode::output));
        while (!board.stop_requested()) {
            const Instant next = board.now() + 100us;  // Listing 1 sleeps, Listing 2 spins; both relative
            way == Way::plain_threads ? board.sleep_until(next) : board.busy_until(next);
            board.pin_write(PinId{6}, Level::high);
            board.pin_write(PinId{6}, Level::low);
        }
    };
    if (way == Way::qduino_mc) {
        EXPECT_TRUE(board.route_interrupts(DeviceClass::all, 1, false));
        EXPECT_TRUE(board.core_timer(1, false));
        program.owning_loop(1, 100us, 1, pulses);
        program.loop(2, 30ms, 100ms, 0, periodic_work(board, 20ms, 100ms));
    } else if (way == Way::qduino) {
        EXPECT_TRUE(board.serve_interrupts(DeviceClass::all, 33));
        program.io(33, 1ms, 100ms, 0);
        program.loop(1, 94ms, 100ms, 0, pulses);
    } else {
        program.loop(1, 100ms, 100ms, 0, pulses);
        program.loop(2, 30ms, 200ms, 0, periodic_work(board, 20ms, 200ms));
    }
    EXPECT_TRUE(board.start(program.specs()));
    board.run(at(kLength));
    return {train.mean_hz(kLength), train.longest()};
}

TEST(SimPaper, ThePulseTrainsComeInThePapersOrder) {
    const Measured own = measure(Way::qduino_mc, false);
    const Measured shared = measure(Way::qduino, false);
    const Measured plain = measure(Way::plain_threads, false);
    EXPECT_NEAR(own.mean_hz, 9569, 1);  // 100 us and two writes of 2.25 us: nothing else is in it
    EXPECT_EQ(own.longest, Nanoseconds{104'500});
    EXPECT_GT(own.mean_hz, 1.04 * shared.mean_hz);
    EXPECT_GT(shared.mean_hz, 1.01 * plain.mean_hz);
}

TEST(SimPaper, LoadIsSeenOnlyWhereTheCoreIsShared) {
    const Measured own_idle = measure(Way::qduino_mc, false), own_loaded = measure(Way::qduino_mc, true);
    const Measured shared_idle = measure(Way::qduino, false), shared_loaded = measure(Way::qduino, true);
    const Measured plain_idle = measure(Way::plain_threads, false),
                   plain_loaded = measure(Way::plain_threads, true);
    EXPECT_EQ(own_loaded.mean_hz, own_idle.mean_hz);
    EXPECT_EQ(own_loaded.longest, own_idle.longest);
    const double shared_drop = 1 - shared_loaded.mean_hz / shared_idle.mean_hz;
    const double plain_drop = 1 - plain_loaded.mean_hz / plain_idle.mean_hz;
    EXPECT_GT(shared_drop, 0.0005);
    EXPECT_GT(plain_drop, 2 * shared_drop);  // bottom halves without a budget
    EXPECT_GT(own_loaded.mean_hz, shared_loaded.mean_hz);
    EXPECT_GT(shared_loaded.mean_hz, plain_loaded.mean_hz);
}

}  // namespace
}  // namespace qduino::board::sim::testing
