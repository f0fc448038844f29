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
//   share     of the core, in the mean; the worst twentieth of the looks left out
//   usual     nine tenths of the time are taken by gaps no longer than this
//   burst     what nine in ten looks had, at the most, beyond the share that is counted
//   longest   nine in ten looks had one longer gap at the most
//
// Admission counts share and burst as one interferer of the usual length, and the longest once in
// every busy window.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/time.h"
#include "sched/load.h"

namespace qduino::board::linux {

/// How long one look spins. Others of the core wait meanwhile.
inline constexpr Nanoseconds kInterferenceLook = 20ms;

/// What one look saw.
struct InterferenceLook {
    Nanoseconds taken{};      ///< by all gaps
    Nanoseconds usual{};      ///< nine tenths of it were taken by gaps no longer than this
    Nanoseconds longest{};    ///< but one
    Nanoseconds worst{};      ///< that one: perhaps a stall of the host
    std::int64_t ticks = 0;   ///< interrupts of the core's own timer, as the kernel counts them
    std::int64_t others = 0;  ///< all other interrupts

    constexpr bool operator==(const InterferenceLook&) const = default;
};

/// Figures of a core: found by looks, or counted by admission.
struct InterferenceFigures {
    std::int64_t share_ppm = 0;  ///< of the core, in millionths
    Nanoseconds usual{};
    Nanoseconds burst{};
    Nanoseconds longest{};

    constexpr bool operator==(const InterferenceFigures&) const = default;
};

/// The figures of `looks`, in any order; zeros without one.
[[nodiscard]] InterferenceFigures figures_of(std::span<const InterferenceLook> looks);

/// Figures for admission: those that were counted `before`, as long as each is as much as was found
/// and no more than twice that; else half as much again as was found. So what is counted stays the
/// same from start to start, until the computer differs.
[[nodiscard]] InterferenceFigures counted_for(const InterferenceFigures& found,
                                              const InterferenceFigures& before);

struct Interference {
    bool measured = false;
    InterferenceFigures found;
    InterferenceFigures counts;
    Nanoseconds worst{};           ///< gap of all looks: reported, and not counted
    Nanoseconds each{};            ///< that an interrupt took, in the mean
    double ticks_per_second = 0;   ///< interrupts of the core's own timer while it spun
    double others_per_second = 0;  ///< all other interrupts

    /// For admission: what comes again and again.
    [[nodiscard]] sched::PlatformInterferer counted() const;
    /// And once in every busy window the longest. The worst gap is not counted: one stall of a
    /// host, which is milliseconds, would refuse every sketch.
    [[nodiscard]] sched::PlatformInterferer counted_once() const;
    /// How many interrupts of the mean length would take the share that is counted.
    [[nodiscard]] double counted_per_second() const;
};

/// What `looks` found; `before`: what was counted at the last start.
[[nodiscard]] Interference interference_of(std::span<const InterferenceLook> looks,
                                           const InterferenceFigures& before);

/// What a run of `length` says, in which `others` interrupts came beside those of timers: a look,
/// if each took as long as those of `known` in the mean. Absent when that is not known.
[[nodiscard]] std::optional<InterferenceLook> look_of_run(const Interference& known, Nanoseconds length,
                                                          std::uint64_t others);

/// Takes `count` looks on `core` at SCHED_FIFO `priority`, in a thread of its
/// own, with a pause of half a look behind each; blocks for as long. Where a tenth of the core is
/// taken it takes up to three times as many, since that may pass. None: without that priority a gap
/// may be any task's. Setup-time.
[[nodiscard]] std::vector<InterferenceLook> look_for_interference(int core, int priority, int count);

}  // namespace qduino::board::linux
