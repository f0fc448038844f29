#include "board/metal/driver/intel_pads.h"

#include <array>

namespace qduino::board::metal {
namespace {

Result<void> check(PinId pin, PinMode mode, std::uint16_t pins) {
    if (pin.number >= pins)
        return make_error(ErrorCode::not_found, "pin ", pin.number, ": these pads are 0 to ", pins - 1);
    if (mode == PinMode::output_open_drain)
        return make_error(ErrorCode::unsupported, "pin ", pin.number, ": these pads have no open drain");
    return {};
}

// ---- Bay Trail ----------------------------------------------------------------------------------

constexpr std::uint32_t kValue = 8;  // the register behind that of the setup
// The bits of the value's register; both enables are active low.
constexpr std::uint32_t kLevel = 1, kOutputOff = 2, kInputOff = 4;

/// Where the registers of GPIO_S0_SC[n] are, in units of 16 bytes.
constexpr std::array<std::uint8_t, BayTrailPads::kPins> kPlaces{
    85, 89, 93, 96, 99, 102, 98, 101, 34, 37, 36, 38, 39,  35, 40, 84,  62, 61, 64, 59, 54,
    56, 60, 55, 63, 57, 51,  50, 53,  47, 52, 49, 48, 43,  46, 41, 45,  42, 58, 44, 95, 105,
    70, 68, 67, 66, 69, 71,  65, 72,  86, 90, 88, 92, 103, 77, 79, 83,  78, 81, 80, 82, 13,
    12, 15, 14, 17, 18, 19,  16, 2,   1,  0,  4,  6,  7,   9,  8,  33,  32, 31, 30, 29, 27,
    25, 28, 26, 23, 21, 20,  24, 22,  5,  3,  10, 11, 106, 87, 91, 104, 97, 100};

/// The function of a pad by which it is a pin, and no line of another device.
std::uint32_t pin_function(PinId pin) { return pin.number == 92 || pin.number == 93 ? 1 : 0; }

std::uint32_t bay_trail_pull(PinMode mode) {
    constexpr std::uint32_t kUp = 1u << 7, kDown = 2u << 7, k20Kiloohm = 2u << 9;
    if (mode == PinMode::input_pullup) return kUp | k20Kiloohm;
    return mode == PinMode::input_pulldown ? kDown | k20Kiloohm : 0;
}

}  // namespace

std::uint64_t BayTrailPads::registers_of(PinId pin) const {
    return at_ + std::uint64_t{kPlaces[pin.number]} * 16;
}

void BayTrailPads::put(std::uint64_t address, std::uint32_t value, std::uint32_t mask) const {
    constexpr int kTries = 4;
    for (int i = 0; i < kTries; ++i) {
        memory_.write(address, value);
        if (((get(address) ^ value) & mask) == 0) return;
    }
}

std::uint32_t BayTrailPads::get(std::uint64_t address) const {
    constexpr int kTries = 4;
    std::uint32_t value = UINT32_MAX;  // what a lost access reads as
    for (int i = 0; i < kTries && value == UINT32_MAX; ++i) value = memory_.read(address);
    return value;
}

Result<void> BayTrailPads::set_mode(PinId pin, PinMode mode, Level level) {
    constexpr std::uint32_t kFunction = 7, kPull = 0xf << 7;
    if (const Result<void> good = check(pin, mode, kPins); !good) return good;
    const std::uint64_t at = registers_of(pin);
    const PortGuard held(lock_);
    const std::uint32_t setup = get(at) & ~(kFunction | kPull);
    std::uint32_t value = get(at + kValue) & ~(kOutputOff | kInputOff);
    if (is_output(mode))
        value = level == Level::high ? value | kLevel : value & ~kLevel;
    else
        value |= kOutputOff;
    put(at + kValue, value, is_output(mode) ? kOutputOff | kLevel : kOutputOff);
    put(at, setup | pin_function(pin) | bay_trail_pull(mode), kFunction | kPull);
    return {};
}

void BayTrailPads::write(PinId pin, Level level) {
    if (pin.number >= kPins) return;
    const std::uint64_t at = registers_of(pin) + kValue;
    const PortGuard held(lock_);
    const std::uint32_t value = get(at);
    put(at, level == Level::high ? value | kLevel : value & ~kLevel, kLevel);
}

Level BayTrailPads::read(PinId pin) {
    if (pin.number >= kPins) return Level::low;
    const PortGuard held(lock_);
    return (get(registers_of(pin) + kValue) & kLevel) != 0 ? Level::high : Level::low;
}

// ---- Apollo Lake --------------------------------------------------------------------------------

namespace {

constexpr std::uint32_t kPads = 0x500;  // the first pad's registers, in a community's
constexpr std::uint32_t kTransmit = 1, kReceive = 2, kTransmitOff = 1u << 8, kReceiveOff = 1u << 9;

std::uint32_t apollo_lake_pull(PinMode mode) {
    constexpr std::uint32_t kUp = 1u << 13, k20Kiloohm = 4u << 10;
    if (mode == PinMode::input_pullup) return kUp | k20Kiloohm;
    return mode == PinMode::input_pulldown ? k20Kiloohm : 0;
}

}  // namespace

std::uint64_t ApolloLakePads::registers_of(PinId pin) const {
    return at_ + kPads + std::uint64_t{pin.number} * 8;
}

/// Some pads are another processor's, or the firmware has locked them.
bool ApolloLakePads::is_ours(PinId pin) const {
    constexpr std::uint32_t kOwners = 0x20, kLocks = 0x60;
    const std::uint32_t owner = memory_.read(at_ + kOwners + pin.number / 8u * 4) >> pin.number % 8 * 4 & 3;
    const std::uint32_t lock = memory_.read(at_ + kLocks + pin.number / 32u * 8) >> pin.number % 32 & 1;
    return owner == 0 && lock == 0;
}

Result<void> ApolloLakePads::set_mode(PinId pin, PinMode mode, Level level) {
    constexpr std::uint32_t kFunction = 0xf << 10, kPull = 0xf << 10;
    if (const Result<void> good = check(pin, mode, pads_); !good) return good;
    if (!is_ours(pin))
        return make_error(ErrorCode::not_permitted, "pin ", pin.number,
                          ": the firmware keeps this pad for something else");
    const std::uint64_t at = registers_of(pin);
    const PortGuard held(lock_);
    std::uint32_t setup = memory_.read(at) & ~(kFunction | kTransmitOff | kReceiveOff | kTransmit);
    if (!is_output(mode)) setup |= kTransmitOff;
    if (is_output(mode) && level == Level::high) setup |= kTransmit;
    memory_.write(at, setup);
    memory_.write(at + 4, (memory_.read(at + 4) & ~kPull) | apollo_lake_pull(mode));
    return {};
}

void ApolloLakePads::write(PinId pin, Level level) {
    if (pin.number >= pads_) return;
    const std::uint64_t at = registers_of(pin);
    const PortGuard held(lock_);
    const std::uint32_t setup = memory_.read(at);
    memory_.write(at, level == Level::high ? setup | kTransmit : setup & ~kTransmit);
}

Level ApolloLakePads::read(PinId pin) {
    if (pin.number >= pads_) return Level::low;
    return (memory_.read(registers_of(pin)) & kReceive) != 0 ? Level::high : Level::low;
}

}  // namespace qduino::board::metal
