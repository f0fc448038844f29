// The board without an operating system against the contract (tests/unit/board/board_contract.h),
// in an image of its own. There is one board in a machine's life, so a boot runs one case.
//
//   loader's words   list           ─► the names of all cases
//                    case=NAME      ─► runs it; "passed" or what was not so
#include <string_view>

#include "board/metal/boot/boot_main.h"
#include "board/metal/metal_board.h"
#include "board/metal/panic.h"
#include "tests/unit/board/board_contract.h"

namespace qduino::board::contract {
namespace {

/// The contract's wires are for one thread; here each core calls them.
class OneAtATime final : public Peripherals {
  public:
    bool report_edges_to(PinEdgeSink& sink) override { return wires.report_edges_to(sink); }
    void pin_written(Instant now, PinId pin, Level level) override {
        const metal::SpinGuard held(lock_);
        wires.pin_written(now, pin, level);
    }
    void pwm_written(Instant now, PinId pin, double duty) override {
        const metal::SpinGuard held(lock_);
        wires.pwm_written(now, pin, duty);
    }
    void pwm_period_set(Instant now, PinId pin, Nanoseconds period) override {
        const metal::SpinGuard held(lock_);
        wires.pwm_period_set(now, pin, period);
    }
    Level pin_level(Instant now, PinId pin) override {
        const metal::SpinGuard held(lock_);
        return wires.pin_level(now, pin);
    }
    double analog_level(Instant now, PinId pin) override { return wires.analog_level(now, pin); }
    Result<void> i2c_transfer(Instant now, I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                              std::span<std::uint8_t> in) override {
        const metal::SpinGuard held(lock_);
        return wires.i2c_transfer(now, bus, address, out, in);
    }
    Result<void> spi_transfer(Instant now, SpiBus bus, SpiSettings settings,
                              std::span<std::uint8_t> data) override {
        const metal::SpinGuard held(lock_);
        return wires.spi_transfer(now, bus, settings, data);
    }

    ContractWires wires{true};

  private:
    metal::SpinLock lock_;
};

class MetalBench {
  public:
    Board& board() {
        static metal::MetalBoard the_board;
        return the_board;
    }
    const ContractWires& finish() { return wired().wires; }
    int current_core() { return metal::this_core().number(); }

    static OneAtATime& wired() {
        static OneAtATime the_wired;
        return the_wired;
    }
};

int run_case(std::string_view name) {
    for (const testing::Case& known : testing::cases()) {
        if (name != known.name) continue;
        known.run();
        if (testing::failures == 0) metal::report("passed\n");
        return testing::failures == 0 ? 0 : 1;
    }
    metal::report("no such case\n");
    return 2;
}

}  // namespace
}  // namespace qduino::board::contract

using MetalBench = qduino::board::contract::MetalBench;
INSTANTIATE_TYPED_TEST_SUITE_P(Metal, qduino::board::contract::BoardContract, MetalBench)

void qduino::board::metal::metal_main(std::string_view words) {
    constexpr std::string_view kCase = "case=";
    pins.wire_to(contract::MetalBench::wired());
    if (words.starts_with(kCase)) turn_off(contract::run_case(words.substr(kCase.size())));
    for (const testing::Case& known : testing::cases()) report(text(known.name, '\n'));
    turn_off(0);
}
