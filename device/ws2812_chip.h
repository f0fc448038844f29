// WS2812: the chips' side. A strip of pixels that takes its colours from one line, by the length of
// its pulses.
//
//   line  ▔▔▔▁▁▁▁▁▁▔▔▔▔▔▔▁▁▁▔▔▔▁▁▁ … ▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁    24 bits a pixel: green, red, blue
//         0: 0.4 µs  1: 0.8 µs         > 50 µs low: all show what they got
//
// A pixel takes the first 24 bits that come, and hands on the others.
//
// Source: Worldsemi, WS2812B data sheet: "Data transfer time", "Composition of 24 bit data".
#pragma once

#include <cstdint>
#include <vector>

#include "base/time.h"

namespace qduino::device {

class Ws2812Chip {
  public:
    static constexpr Nanoseconds kZero{400}, kOne{800}, kTolerance{150};
    static constexpr Nanoseconds kLatch{50'000};

    explicit Ws2812Chip(std::size_t pixels) : shown_(pixels), received_(pixels) {}

    /// The level of the line from `now` on.
    void data(Instant now, bool high) {
        if (high == high_) return;
        high_ = high;
        if (high) {
            settle(now);
        } else {
            take(now - changed_);
        }
        changed_ = now;
    }
    /// Shows what was received, if the line has been low for long enough.
    void settle(Instant now) {
        if (bits_ == 0 || now - changed_ < kLatch) return;
        for (std::size_t i = 0; i < bits_ / 24 && i < shown_.size(); ++i) shown_[i] = received_[i];
        if (bits_ % 24 != 0) ++unclear_;
        bits_ = 0;
        ++frames_;
    }
    /// 0xRRGGBB of each.
    [[nodiscard]] const std::vector<std::uint32_t>& shown() const { return shown_; }
    [[nodiscard]] std::uint64_t frames() const { return frames_; }
    /// Pulses that are neither a 0 nor a 1 by the data sheet, and frames that ended within a pixel.
    [[nodiscard]] std::uint64_t unclear() const { return unclear_; }

  private:
    void take(Nanoseconds high) {
        const auto is = [&](Nanoseconds wanted) {
            return high >= wanted - kTolerance && high <= wanted + kTolerance;
        };
        if (!is(kZero) && !is(kOne)) ++unclear_;
        const std::size_t pixel = bits_ / 24;
        // Green comes first, and stands in the middle of 0xRRGGBB.
        const std::size_t color = bits_ / 8 % 3, bit = 7 - bits_ % 8;
        ++bits_;
        if (pixel >= received_.size()) return;
        const std::size_t shift = (color == 0 ? 8 : color == 1 ? 16 : 0) + bit;
        const bool one = high > (kZero + kOne) / 2;
        received_[pixel] = (received_[pixel] & ~(1u << shift)) | std::uint32_t{one} << shift;
    }

    std::vector<std::uint32_t> shown_, received_;
    bool high_ = false;
    Instant changed_{};
    std::size_t bits_ = 0;  // of this frame
    std::uint64_t frames_ = 0, unclear_ = 0;
};

}  // namespace qduino::device
