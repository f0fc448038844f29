// HX711: the chip's side. A converter for load cells of 24 bits, which a clock from outside shifts
// out.
//
//   DOUT  ▔▔▔▔▁▁▁▁◆b23◆b22◆ … ◆b0◆▔▔▔▔▔   low: a result is ready
//   SCK   ▁▁▁▁▁▁▁▁▁█▁▁▁█▁▁▁ … █▁▁▁█▁▁▁▁   the 25th to 27th pulse choose what is converted next
//
// Source: Avia Semiconductor, HX711 data sheet: "Serial interface", "Reset and power-down
// sequence", table 3.
#pragma once

#include <algorithm>
#include <cstdint>

#include "base/time.h"

namespace qduino::device {

/// What is converted. Numbers are pulses beyond the 24 of the data.
enum class Hx711Input : std::uint8_t { a_128 = 1, b_32 = 2, a_64 = 3 };

class Hx711Chip {
  public:
    /// With RATE low: ten conversions a second.
    static constexpr Nanoseconds kPeriod{100'000'000};
    /// Four conversions after power comes, or a new input is chosen.
    static constexpr Nanoseconds kSettling{400'000'000};
    /// SCK high for longer switches the chip off.
    static constexpr Nanoseconds kPowerDown{60'000};
    static constexpr std::int32_t kLargest = 0x7F'FFFF, kSmallest = -0x80'0000;

    /// `value`: what input A reads with a gain of 128, in steps; beyond 24 bits it saturates.
    /// `value_b`: the same of input B, with its gain of 32.
    explicit Hx711Chip(std::int32_t value, std::int32_t value_b = 0) : value_(value), value_b_(value_b) {}

    /// The level of SCK from `now` on.
    void clock(Instant now, bool high) {
        if (high == clock_) return;
        clock_ = high;
        if (high) return rise(now);
        if (now - risen_ < kPowerDown) return fall(now);
        ++power_downs_;
        input_ = Hx711Input::a_128;
        pulses_ = 0;
        ready_ = now + kSettling;
    }
    /// The level of DOUT.
    [[nodiscard]] bool data(Instant now) const {
        if (clock_ && now - risen_ >= kPowerDown) return true;
        return between_results() ? now < ready_ : ((shifted_ >> (kBits - pulses_)) & 1) != 0;
    }
    /// What the next result is of.
    [[nodiscard]] Hx711Input input() const { return input_; }
    /// Results that were read whole, and how often the chip was switched off.
    [[nodiscard]] std::uint64_t results() const { return results_; }
    [[nodiscard]] std::uint64_t power_downs() const { return power_downs_; }

  private:
    static constexpr int kBits = 24;

    [[nodiscard]] bool between_results() const { return pulses_ == 0 || pulses_ > kBits; }
    void rise(Instant now) {
        risen_ = now;
        if (between_results() && now >= ready_) {
            pulses_ = 0;
            converted_ = input_;
            shifted_ = static_cast<std::uint32_t>(converted()) & 0xFF'FFFF;
            ready_ = kForever;
        }
        // Pulses while nothing is ready, and more than there are inputs, mean nothing.
        if (ready_ != kForever && pulses_ == 0) return;
        if (pulses_ < kBits + 3) ++pulses_;
    }
    void fall(Instant now) {
        if (pulses_ <= kBits) return;
        if (pulses_ == kBits + 1) ++results_;
        input_ = static_cast<Hx711Input>(pulses_ - kBits);
        ready_ = now + (input_ == converted_ ? kPeriod : kSettling);
    }
    [[nodiscard]] std::int32_t converted() const {
        std::int32_t value = value_;
        if (input_ == Hx711Input::b_32) value = value_b_;
        if (input_ == Hx711Input::a_64) value /= 2;
        return std::clamp(value, kSmallest, kLargest);
    }

    std::int32_t value_, value_b_;
    Hx711Input input_ = Hx711Input::a_128;  // chosen for the next result
    Hx711Input converted_ = input_;
    bool clock_ = false;
    int pulses_ = 0;  // of the result that is being read
    std::uint32_t shifted_ = 0;
    Instant risen_{};
    Instant ready_ = kEpoch + kSettling;
    std::uint64_t results_ = 0, power_downs_ = 0;
};

}  // namespace qduino::device
