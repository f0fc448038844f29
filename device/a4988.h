// A4988: the facts a driver of this stepper chip must keep.
//
// Source: Allegro MicroSystems, A4988 data sheet, "Timing requirements" and "Microstepping
// resolution truth table".
//
//            ┌──── A ────┐           ┌────
//   STEP ────┘           └──── B ────┘      A  STEP high  >= 1 µs  C  set-up of DIR, MSx  >= 200 ns
//        ──┐ C   D ┌──────                  B  STEP low   >= 1 µs  D  hold of DIR, MSx    >= 200 ns
//   DIR  ──┴───────┴──────
#pragma once

#include <optional>

#include "base/time.h"

namespace qduino::device::a4988 {

inline constexpr Nanoseconds kStepHighMin{1000};
inline constexpr Nanoseconds kStepLowMin{1000};
inline constexpr Nanoseconds kDirectionSetupMin{200};
inline constexpr Nanoseconds kDirectionHoldMin{200};

/// Microsteps per full step for the levels of MS1, MS2, MS3; empty for the combinations that the
/// table leaves out.
constexpr std::optional<int> microsteps(bool ms1, bool ms2, bool ms3) {
    if (!ms1 && !ms2 && !ms3) return 1;
    if (ms1 && !ms2 && !ms3) return 2;
    if (!ms1 && ms2 && !ms3) return 4;
    if (ms1 && ms2 && !ms3) return 8;
    if (ms1 && ms2 && ms3) return 16;
    return std::nullopt;
}

}  // namespace qduino::device::a4988
