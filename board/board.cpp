#include "board/board.h"

#include "board/early_pins.h"

namespace qduino::board {
namespace {

constinit EarlyPins early_pins;

Error unsupported(std::string_view what) { return make_error(ErrorCode::unsupported, "this board ", what); }

/// The board of a program that has none yet.
class NoBoard final : public Board {
  public:
    Instant now() override { return kEpoch; }
    void busy_until(Instant) override {}
    void busy_for(Nanoseconds) override {}
    void sleep_until(Instant) override {}
    Result<void> pin_mode(PinId pin, PinMode mode) override { return early_pins.mode(pin, mode); }
    void pin_write(PinId pin, Level level) override { early_pins.write(pin, level); }
    Level pin_read(PinId pin) override { return early_pins.read(pin); }
    Result<void> safe_state(PinId, Level) override { return not_running(); }
    Result<void> pwm_write(PinId pin, double duty) override { return early_pins.pwm(pin, duty); }
    Result<void> pwm_period(PinId, Nanoseconds) override { return not_running(); }
    Result<double> analog_read(PinId) override { return not_running(); }
    Result<void> attach_edge(PinId, Edge, EdgeHandler, void*, VcpuId) override { return not_running(); }
    Result<void> i2c_transfer(I2cBus, I2cAddress, std::span<const std::uint8_t>,
                              std::span<std::uint8_t>) override {
        return not_running();
    }
    Result<void> spi_transfer(SpiBus, SpiSettings, std::span<std::uint8_t>) override { return not_running(); }
    void lock(LockWord&) override {}
    bool try_lock(LockWord&) override { return true; }
    void unlock(LockWord&) override {}
    int core_count() const override { return 1; }
    VcpuId current_vcpu() const override { return kNoVcpu; }
    Result<void> start(std::span<const VcpuSpec>) override { return not_running(); }
    void run(Instant) override {}
    void request_stop() override {}
    bool stop_requested() override { return false; }
    GuaranteeReport guarantee() const override { return {}; }
    Result<void> route_interrupts(DeviceClass, int, bool) override { return not_running(); }
};

constinit NoBoard no_board;

}  // namespace

constinit Board* detail::current = &no_board;

void make_current(Board* board) { detail::current = board ? board : &no_board; }

void hand_over_early_pins(PinRefused refused) { early_pins.hand_over(current(), refused); }

Error not_running() {
    return make_error(ErrorCode::unavailable,
                      "the board is not running yet: call this from setup() or a loop");
}

// ---- capabilities that a board may lack ---------------------------------------------------------

void Board::pins_write(std::span<const PinId> pins, Level level) {
    for (const PinId pin : pins) pin_write(pin, level);
}
Result<void> Board::pwm_write(PinId, double) { return unsupported("has no PWM"); }
Result<void> Board::pwm_period(PinId, Nanoseconds) { return unsupported("has no PWM"); }
Result<double> Board::analog_read(PinId) { return unsupported("has no analog inputs"); }
Result<double> Board::chip_temperature() { return unsupported("has no thermometer"); }
Result<void> Board::attach_edge(PinId, Edge, EdgeHandler, void*, VcpuId) {
    return unsupported("has no interrupts on its pins");
}
void Board::detach_edge(PinId) {}

Result<void> Board::i2c_transfer(I2cBus, I2cAddress, std::span<const std::uint8_t>, std::span<std::uint8_t>) {
    return unsupported("has no I2C bus");
}
Result<void> Board::spi_transfer(SpiBus, SpiSettings, std::span<std::uint8_t>) {
    return unsupported("has no SPI bus");
}

/// I2C: eight bits and an acknowledge for each byte, at 100 kHz where nobody said (the bus'
/// specification, UM10204). SPI: eight bits, at 4 MHz.
Nanoseconds Board::bus_time(DeviceClass device, std::size_t bytes, std::uint32_t clock_hz) const {
    const auto time = [&](std::int64_t bits, std::uint32_t usual_hz) {
        constexpr std::int64_t kSecond = 1'000'000'000;
        return Nanoseconds{static_cast<std::int64_t>(bytes) * bits * kSecond /
                           (clock_hz ? clock_hz : usual_hz)};
    };
    if (device == DeviceClass::i2c) return time(9, 100'000);
    return device == DeviceClass::spi ? time(8, 4'000'000) : Nanoseconds{0};
}

sched::PlatformOverheads Board::platform_overheads(int) { return {}; }
Result<void> Board::serve_interrupts(DeviceClass, VcpuId) {
    return unsupported("cannot give a device's bottom half to an I/O VCPU");
}
Result<void> Board::change_io(VcpuId, sched::VcpuParameters) {
    return unsupported("cannot change an I/O VCPU that runs");
}
Result<void> Board::route_interrupts(DeviceClass, int, bool) {
    return unsupported("cannot route a device's interrupts");
}
Result<void> Board::core_timer(int, bool) { return unsupported("cannot stop a core's scheduling tick"); }

}  // namespace qduino::board
