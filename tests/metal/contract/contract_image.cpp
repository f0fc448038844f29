// The board without an operating system against the contract (tests/unit/board/board_contract.h),
// in an image of its own. There is one board in a machine's life, so a boot runs one case.
//
//   loader's words   list           ─► the names of all cases
//                    case=NAME      ─► runs it; "passed" or what was not so
#include "tests/metal/contract/wires.h"

#include <array>
#include <string_view>

#include "board/metal/boot/boot_main.h"
#include "board/metal/metal_board.h"
#include "board/metal/panic.h"
#include "tests/unit/board/board_contract.h"

namespace qduino::board::contract {
namespace {

/// What a wire drives onto a pin.
class Inputs final : public PinEdgeSink {
  public:
    void pin_edge(Instant, PinId pin, Level level) override { metal::pins.driven(pin, level); }
};

class MetalBench {
  public:
    Board& board() {
        static metal::MetalBoard the_board;
        return the_board;
    }
    const ContractWires& finish() { return wires(); }
    int current_core() { return metal::this_core().number(); }

    static ContractWires& wires() {
        static ContractWires the_wires{true};
        return the_wires;
    }
};

/// Cases of what this board has not; such a call answers `unsupported`.
constexpr std::array<std::string_view, 6> kLacking{
    "PwmArrivesAsItsDutyAndOnlyWithinBounds", "APwmHasThePeriodThatItIsGiven", "I2cCarriesExactBytesBothWays",
    "AnAddressWithoutAChipTimesOut",          "SpiIsFullDuplexInPlace",        "AnAnalogPinReadsItsVoltage"};

template <typename Answer>
void expect_unsupported(const Answer& answer) {
    ASSERT_FALSE(answer);
    EXPECT_EQ(answer.error().code, ErrorCode::unsupported);
}

void expect_nothing_but_refusals() {
    Board& board = MetalBench().board();
    std::array<std::uint8_t, 2> bytes{};
    expect_unsupported(board.pwm_write(kHeater, 0.5));
    expect_unsupported(board.pwm_period(kHeater, 20ms));
    expect_unsupported(board.analog_read(kVoltage));
    expect_unsupported(board.i2c_transfer(kI2c, kChip, bytes, bytes));
    expect_unsupported(board.spi_transfer(kSpi, {}, bytes));
}

int run_case(std::string_view name) {
    for (const testing::Case& known : testing::cases()) {
        if (name != known.name) continue;
        std::ranges::find(kLacking, name) == kLacking.end() ? known.run() : expect_nothing_but_refusals();
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

void qduino::board::metal::write_to_wires(std::uint16_t, std::uint8_t byte) {
    static SpinLock one_at_a_time;
    static contract::Inputs inputs;
    const SpinGuard held(one_at_a_time);
    contract::ContractWires& wires = contract::MetalBench::wires();
    static_cast<void>(wires.report_edges_to(inputs));
    wires.pin_written(tsc_clock.now(), PinId{static_cast<std::uint16_t>(byte & 0x7f)},
                      (byte & 0x80) != 0 ? Level::high : Level::low);
}

void qduino::board::metal::metal_main(std::string_view words) {
    constexpr std::string_view kCase = "case=";
    if (words.starts_with(kCase)) turn_off(contract::run_case(words.substr(kCase.size())));
    for (const testing::Case& known : testing::cases()) report(text(known.name, '\n'));
    turn_off(0);
}
