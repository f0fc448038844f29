#include "board/metal/driver/pl061.h"

#include "board/metal/computer/instructions.h"
#include "board/metal/pins.h"

namespace qduino::board::metal {
namespace {

constexpr std::uint32_t kDirections = 0x400, kLevels = 0x404, kBothEdges = 0x408, kMask = 0x410,
                        kRaised = 0x414, kClear = 0x41c;

}  // namespace

Pl061::Pl061(std::uint64_t at) : at_(at) {
    memory_write(at_ + kMask, 0);
    memory_write(at_ + kDirections, 0);
    memory_write(at_ + kLevels, 0);  // edges interrupt
    memory_write(at_ + kBothEdges, 0xff);
    memory_write(at_ + kClear, 0xff);
}

Result<void> Pl061::set_mode(PinId pin, PinMode mode, Level level) {
    if (pin.number >= kPins)
        return make_error(ErrorCode::not_found, "pin ", pin.number, ": a PL061 has the pins 0 to 7");
    if (mode != PinMode::input && mode != PinMode::output)
        return make_error(ErrorCode::unsupported, "pin ", pin.number,
                          ": a PL061 has no pull-ups, no pull-downs and no open drain");
    const std::uint32_t bit = 1u << pin.number;
    const PortGuard held(lock_);
    directions_ = mode == PinMode::output ? directions_ | bit : directions_ & ~bit;
    listens_ = ~directions_ & (listens_ | bit);
    memory_write(at_ + kDirections, directions_);
    if (mode == PinMode::output) write(pin, level);  // an input's level cannot be written
    memory_write(at_ + kClear, bit);
    levels_ = read(pin) == Level::high ? levels_ | bit : levels_ & ~bit;
    if (!quiet_) memory_write(at_ + kMask, listens_);
    return {};
}

void Pl061::write(PinId pin, Level level) {
    if (pin.number >= kPins) return;
    const std::uint32_t bit = 1u << pin.number;
    memory_write(at_ + (bit << 2), level == Level::high ? bit : 0);
}

Level Pl061::read(PinId pin) {
    if (pin.number >= kPins) return Level::low;
    return memory_read(at_ + (4u << pin.number)) != 0 ? Level::high : Level::low;
}

void Pl061::quiet() {
    const PortGuard held(lock_);
    quiet_ = true;
    memory_write(at_ + kMask, 0);
}

/// An edge that comes between the two accesses of a turn is in the level, and makes another turn.
/// So behind the last one no edge is unseen, and where the level is as before there was a pulse.
void Pl061::report(PinId pin) {
    constexpr int kMostTurns = 8;  // of a line that never rests
    const std::uint32_t bit = 1u << pin.number;
    Level level = Level::low;
    for (int turn = 0; turn == 0 || (turn < kMostTurns && (memory_read(at_ + kRaised) & bit) != 0); ++turn) {
        memory_write(at_ + kClear, bit);
        level = read(pin);
    }
    const bool was_high = (levels_ & bit) != 0, is_high = level == Level::high;
    if (was_high == is_high) pins.driven(pin, is_high ? Level::low : Level::high);
    pins.driven(pin, level);
    levels_ = is_high ? levels_ | bit : levels_ & ~bit;
}

void Pl061::serve() {
    const std::uint32_t raised = memory_read(at_ + kRaised) & listens_;
    for (std::uint16_t number = 0; number < kPins; ++number) {
        if ((raised & 1u << number) != 0) report(PinId{number});
    }
    const InterruptsOff off;
    const PortGuard held(lock_);
    quiet_ = false;
    memory_write(at_ + kMask, listens_);
}

}  // namespace qduino::board::metal
