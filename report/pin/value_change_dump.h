// The changes of pins as a value change dump (IEEE 1364-2005, 18.2), in nanoseconds: GTKWave,
// PulseView and others show it.
//
//   $timescale 1 ns $end            the head needs the names of all pins, which are known at the
//   $var wire 1 p13 pin13 $end      end; so head() is asked for last, and stands first
//   $var real 64 d9 pin9_duty $end
//   $dumpvars xp13 …                a level is unknown before the first write
//   #500000000                      each instant once, with what changed at it
//   0p13
//
// A PWM output has its duty (0 to 1) beside its level, which is unknown unless the duty is 0 or 1:
// a dump with each of its edges would be large, and say no more.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "board/types.h"

namespace qduino::apps {

/// Told in order of time. What is no change is left out.
class ValueChangeDump {
  public:
    /// '0', '1', 'x' (unknown) or 'z' (the board drives it no more). Contract: pin < kPinCount.
    void level(std::int64_t ns, std::uint16_t pin, char value);
    void duty(std::int64_t ns, std::uint16_t pin, double duty);
    /// The dump ends here, whether or not something changes.
    void end(std::int64_t ns) { at(ns); }

    /// What was told since the last call. The pieces in order, behind head(), are the dump.
    [[nodiscard]] std::string take_body();
    /// So many bytes wait for take_body().
    [[nodiscard]] std::size_t held() const { return body_.size(); }
    [[nodiscard]] std::string head() const;

  private:
    void at(std::int64_t ns);

    struct Seen {
        char level = 0;  // none yet
        double duty = -1;
    };
    std::array<Seen, board::kPinCount> pins_{};
    std::int64_t now_ = 0;
    std::string body_;
};

}  // namespace qduino::apps
