// What interrupts take of a core on this computer: ticks, top halves, softirqs, and what a
// hypervisor takes. No counter of the kernel has their cost, so a bare spin measures it
// (bare_spin.h). Its gaps above 1 us count.
//
// One spin of 40 ms says little. Beside other programs, or on a virtual machine, one such look
// finds 2 % of the core taken, and the next one 18 %; so a sketch would be admitted at one start
// and refused at the next. So many looks are taken, with pauses in which others run, and they are
// remembered from start to start (interference_memory.h):
//
//   spin    ▪▪▪▪ ▪▪▪ ▪▪▪▪▪    ▪▪▪ ▪▪▪▪▪▪▪▪▪    ▪▪▪▪▪▪▪     ▪
//           └─ look, 20 ms ┘  └─ look, 20 ms ┘ └─ … ┘
//
// What admission needs is a bound on the time that is taken in a window of any length. A share of
// the core alone is none: a gap comes whole. So a look keeps, for each of some rates, how far its
// gaps ever ran ahead of that rate, whatever the window (the burstiness of R. L. Cruz, "A calculus
// for network delay", IEEE ToIT 1991): the most that a bucket ever held into which gaps pour and
// which leaks at the rate.
//
//   taken │         ┌─ rate·w      in a window w of this look never more is taken than
//         │       ┌─┘               burst(rate) + rate·w
//         │  ┌────┘ ↕ burst
//         └──┴──────────────── w
//
// Admission counts two such pairs, and of both the one that allows less (sched/load.h):
//
//   share  the least of the rates that is a fifth above the mean share of all looks, the worst
//          twentieth left out, with the burst that nine in ten looks stayed within
//   peak   the same at a rate 2.5 times as high: short windows have less in them
//
// and to each burst a quarter more. A look that had more is a **stall**: a fault of this computer
// that is said by this name, with how many there were, and that no R has in it. One of 0.9 ms that
// comes once in two seconds would otherwise stand in each period of a loop of 1 ms.
//
// The figures that are counted stay, from start to start, until the looks refute them: share, when
// the mean is above it or below half of it; a burst, when so many looks had more that nine in ten
// cannot be true of it (by two standard deviations and one look), or so few had half of it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/time.h"
#include "sched/load.h"

namespace qduino::board::linux {

/// How long one look spins. Others of the core wait meanwhile.
inline constexpr Nanoseconds kInterferenceLook = 20ms;

/// Rates in millionths of a core, about three fifths above each other (R5 of ISO 3).
inline constexpr std::array<std::int64_t, 15> kInterferenceRates{1'000,   1'600,   2'500,   4'000,   6'300,
                                                                 10'000,  16'000,  25'000,  40'000,  63'000,
                                                                 100'000, 160'000, 250'000, 400'000, 630'000};

/// What one look saw.
struct InterferenceLook {
    Nanoseconds taken{};  ///< by all gaps
    Nanoseconds worst{};  ///< the longest gap
    /// By rate; of a run, which sees how many interrupts came and not when, nothing.
    std::array<Nanoseconds, kInterferenceRates.size()> bursts{};
    std::int64_t ticks = 0;   ///< interrupts of the core's own timer, as the kernel counts them
    std::int64_t others = 0;  ///< all other interrupts

    constexpr bool operator==(const InterferenceLook&) const = default;
};

/// The gaps of one look, in order.
class InterferenceGaps {
  public:
    /// `between` two looks at the clock: a gap where it is longer than any of the spin's own.
    void add(Nanoseconds between);
    [[nodiscard]] const InterferenceLook& look() const { return look_; }

  private:
    InterferenceLook look_;
    Nanoseconds since_gap_{};
    std::array<double, kInterferenceRates.size()> held_{};  // ns in each bucket
};

/// What admission counts of a core: in a window w no more than burst + share·w, and no more than
/// peak_burst + peak·w.
struct InterferenceFigures {
    std::int64_t share_ppm = 0;  ///< of the core, in millionths; 0: nothing is taken
    Nanoseconds burst{};
    std::int64_t peak_ppm = 0;  ///< 0: no second pair
    Nanoseconds peak_burst{};

    /// The most that comes in the shortest window.
    [[nodiscard]] Nanoseconds at_once() const { return peak_ppm > 0 ? std::min(burst, peak_burst) : burst; }
    constexpr bool operator==(const InterferenceFigures&) const = default;
};

struct Interference {
    bool measured = false;
    std::int64_t found_ppm = 0;  ///< of the core, in the mean; the worst twentieth left out
    InterferenceFigures counts;
    Nanoseconds worst{};           ///< gap of all looks
    Nanoseconds each{};            ///< that an interrupt took, in the mean
    double ticks_per_second = 0;   ///< interrupts of the core's own timer while it spun
    double others_per_second = 0;  ///< all other interrupts
    std::size_t looks = 0;         ///< spins …
    std::size_t stalls = 0;        ///< … and those that had more than is counted

    /// For admission, in steps of 10 us.
    [[nodiscard]] sched::PlatformInterferer counted() const;
    /// How many interrupts of the mean length would take the share that is counted.
    [[nodiscard]] double counted_per_second() const;
};

/// What `looks` found, and beside them `runs` (look_of_run()); `before`: what was counted at the
/// last start.
[[nodiscard]] Interference interference_of(std::span<const InterferenceLook> looks,
                                           std::span<const InterferenceLook> runs,
                                           const InterferenceFigures& before);

/// What a run of `length` says, in which `others` interrupts came beside those of timers, if each
/// took as long as those of `known` in the mean. Absent when that is not known.
[[nodiscard]] std::optional<InterferenceLook> look_of_run(const Interference& known, Nanoseconds length,
                                                          std::uint64_t others);

/// Takes `count` looks on `core` at SCHED_FIFO `priority`, in a thread of its
/// own, with a pause of half a look behind each; blocks for as long. Where a tenth of the core is
/// taken it takes up to three times as many, since that may pass. None: without that priority a gap
/// may be any task's. Setup-time.
[[nodiscard]] std::vector<InterferenceLook> look_for_interference(int core, int priority, int count);

}  // namespace qduino::board::linux
