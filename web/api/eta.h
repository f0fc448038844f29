// How long a running copy will still take, by the printer's own estimate and by what has been
// measured of this copy.
//
//   file    ├────── executed ──────┤ byte
//   time    ├───── t (profile) ────┤········· M − t ·········┤   without the waits for heat
//   clock   ├───── e (measured) ──────┤···· (M − t)·e/t ·····┤   at M220 S80, say
//
// The profile (printer/estimate/time_profile.h, in the job's facts) says at which byte the file
// is after each step of time. Bytes alone would mislead: a layer of infill has few of them and
// takes long. The ratio e/t needs some minutes to mean anything, so it begins at 1. The waits for
// heat stand apart: a bed that was still warm says nothing about the motion.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>

namespace qduino::web::api {

/// What has been done of a copy.
struct Executed {
    std::uint64_t bytes = 0;
    double time_s = 0;     ///< pauses excluded
    double heating_s = 0;  ///< … of it, waiting for heat
};

/// Seconds, not negative. `facts`: the job's; without a profile in them the bytes must do.
/// `estimated_s` > 0 is what a whole copy of `size` bytes takes.
[[nodiscard]] double remaining_s(const nlohmann::ordered_json& facts, double estimated_s, std::uint64_t size,
                                 const Executed& executed);

/// How much of a copy's time is over, 0…1, from the seconds that have passed and that are left. So
/// percents and times say the same. 0 where both are 0.
[[nodiscard]] constexpr double share_of_time(double elapsed_s, double remaining_s) {
    const double whole_s = elapsed_s + remaining_s;
    return whole_s > 0 ? elapsed_s / whole_s : 0;
}

}  // namespace qduino::web::api
