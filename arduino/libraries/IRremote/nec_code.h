// NEC's infrared code, as lengths of marks (light) and spaces. (SB-Projects, "NEC Protocol"; the
// code of NEC's µPD6121.)
//
//   ████████████████▁▁▁▁▁▁▁▁█▁█▁▁▁█▁ … █    leader 9 ms and 4.5 ms, 32 bits, a last mark
//                            0  1           0: 560 µs and 560 µs, 1: 560 µs and 1690 µs
//   ████████████████▁▁▁▁█                   the key is still held: 9 ms and 2.25 ms, a mark
//
// The lowest bit comes first: the address (16), the command (8), the command inverted (8). Frames
// begin 110 ms apart.
#pragma once

#include <cstdint>
#include <optional>

#include "base/time.h"

namespace qduino::arduino::nec {

inline constexpr Nanoseconds kLeader{9'000'000}, kSpace{4'500'000}, kRepeatSpace{2'250'000};
inline constexpr Nanoseconds kMark{560'000}, kZero{560'000}, kOne{1'690'000};
inline constexpr Nanoseconds kFramePeriod{110'000'000};
inline constexpr double kCarrierHz = 38'000;
inline constexpr int kBits = 32;

struct Frame {
    std::uint32_t raw = 0;
    bool is_repeat = false;  ///< then there are no bits
};

/// The bits of a frame.
constexpr std::uint32_t raw_of(std::uint16_t address, std::uint8_t command) {
    return std::uint32_t{address} | std::uint32_t{command} << 16 |
           std::uint32_t{static_cast<std::uint8_t>(~command)} << 24;
}

class Decoder {
  public:
    /// A mark or a space of this length has ended. Returns the frame that its last mark completes.
    std::optional<Frame> feed(bool mark, Nanoseconds length) {
        if (mark) return take_mark(length);
        take_space(length);
        return std::nullopt;
    }

  private:
    enum class Wants : std::uint8_t { leader, space, bits, repeat };

    /// A quarter longer or shorter, and what a receiver adds or takes.
    static constexpr bool is(Nanoseconds length, Nanoseconds wanted) {
        const Nanoseconds off = length > wanted ? length - wanted : wanted - length;
        return off <= wanted / 4 + Nanoseconds{50'000};
    }
    std::optional<Frame> take_mark(Nanoseconds length) {
        const Wants wanted = wants_;
        if (is(length, kLeader)) {
            wants_ = Wants::space;
            return std::nullopt;
        }
        if (wanted == Wants::bits && is(length, kMark) && count_ < kBits) return std::nullopt;
        wants_ = Wants::leader;
        if (!is(length, kMark)) return std::nullopt;
        if (wanted == Wants::repeat) return Frame{.raw = 0, .is_repeat = true};
        if (wanted == Wants::bits) return Frame{.raw = raw_, .is_repeat = false};
        return std::nullopt;
    }
    void take_space(Nanoseconds length) {
        if (wants_ == Wants::space && is(length, kSpace)) {
            wants_ = Wants::bits;
            raw_ = 0;
            count_ = 0;
        } else if (wants_ == Wants::space && is(length, kRepeatSpace)) {
            wants_ = Wants::repeat;
        } else if (wants_ == Wants::bits && (is(length, kZero) || is(length, kOne))) {
            raw_ |= std::uint32_t{is(length, kOne)} << count_++;
        } else {
            wants_ = Wants::leader;
        }
    }

    Wants wants_ = Wants::leader;
    std::uint32_t raw_ = 0;
    int count_ = 0;
};

/// `put(mark, length)` for each mark and space of a frame, in order.
template <typename Put>
void encode(Frame frame, Put put) {
    put(true, kLeader);
    put(false, frame.is_repeat ? kRepeatSpace : kSpace);
    for (int bit = 0; bit < kBits && !frame.is_repeat; ++bit) {
        put(true, kMark);
        put(false, (frame.raw >> bit & 1) != 0 ? kOne : kZero);
    }
    put(true, kMark);
}

}  // namespace qduino::arduino::nec
