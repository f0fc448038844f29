// The pulse trains that bench-pulse-train compares, each made in a process of its own.
//
//   listing1       nanosleep(100 µs), write 1, write 0, as the paper ran its Listing 1: real-time
//                  priority, locked memory, timers without slack (its footnote 6)
//   listing1_plain the same as an ordinary process
//   listing2       sketches/listing_2, the paper's Listing 2: a loop that owns its core and spins
//                  100 µs, then writes
//   absolute       sketches/pulse_train_absolute: the same with delayBusyUntil(t += 100 µs)
//   floor          a bare spin over the same grid, without pins or a sketch: the limit of this core
//   floor_relative a bare spin of 100 µs, again and again: the limit for Listing 2, which never
//                  makes up for lost time
//
// The first four are seen from outside, by the edges on virtual pin 6, with the time that the
// board stamped on each.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/time.h"
#include "bench/rig/report.h"

namespace qduino::bench {

/// The result of one run of one train.
struct Train {
    /// Instants of the rising edges, in order, without those of the start.
    std::vector<std::int64_t> rising_ns;
    std::uint64_t lost_edges = 0;
    Json guarantee;       ///< what the board said; null for Listing 1
    std::string failure;  ///< empty: it ran to its end
};

/// A train that did not run.
inline Train failed_train(std::string failure) {
    Train train;
    train.failure = std::move(failure);
    return train;
}

inline constexpr Nanoseconds kTrainPeriod = 100us;
inline constexpr int kTrainPin = 6;

/// `real_time`: as the paper ran it. An ordinary user gets the plain one; the guarantee says so.
Train run_listing1(Nanoseconds length, bool real_time);
/// `program`: listing-2-linux or pulse-train-absolute-linux.
Train run_sketch(const std::string& program, Nanoseconds length);
/// `phase`: the place of the instants within their period, on CLOCK_MONOTONIC. The scheduling tick
/// comes at multiples of 4 ms, which is forty periods: either every tick falls on an instant of the
/// grid or none does. So only trains of the same phase can be compared.
Train run_floor(Nanoseconds length, Nanoseconds phase);
Train run_floor_relative(Nanoseconds length);
/// The phase that `train` had; zero when it made no pulses.
Nanoseconds phase_of(const Train& train);

}  // namespace qduino::bench
