// The words of the scheduling theory: what a VCPU is given, and how it is named.
//
// sched/ is pure and freestanding: no clock, no heap, no operating system, no exceptions. Time is a
// parameter, in integer nanoseconds. The same code schedules board/sim and keeps the accounts of
// board/linux.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/time.h"

namespace qduino::sched {

/// A VCPU's name, unique on its computer. The number has one meaning in sched/: at equal periods
/// the lower number has the higher priority.
using VcpuId = std::uint8_t;

inline constexpr std::size_t kMainVcpuLimit = 32;  ///< main VCPUs (loops) per core
inline constexpr std::size_t kIoVcpuLimit = 31;    ///< I/O VCPUs (bottom halves) per core
inline constexpr std::size_t kChainLimit = 16;     ///< chains of a sketch (chain.h)
inline constexpr int kAnyCore = -1;

/// Longer periods are refused, so that every sum of the analysis stays far below the limit of 64
/// bits.
inline constexpr Nanoseconds kPeriodMax = std::chrono::hours{24};

/// `budget` of CPU time in every `period`. For an I/O VCPU only their ratio counts, its
/// utilisation: its budget and priority at an instant follow from the main VCPU that it serves
/// (pibs.h).
struct VcpuParameters {
    Nanoseconds budget{};
    Nanoseconds period{};

    /// 0 < budget <= period <= kPeriodMax.
    [[nodiscard]] constexpr bool valid() const {
        return budget > Nanoseconds{0} && budget <= period && period <= kPeriodMax;
    }
    /// budget == period: a VCPU with a core of its own, which is never throttled.
    [[nodiscard]] constexpr bool whole_core() const { return budget == period; }
    constexpr bool operator==(const VcpuParameters&) const = default;
};

enum class VcpuKind : std::uint8_t {
    main,  ///< a loop, on a sporadic server
    io,    ///< a bottom half, on a priority-inheriting bandwidth-preserving server (PIBS)
};

/// A VCPU, from its declaration to its thread. Each floor derives from it what that floor adds: the
/// runtime a body, a board an entry, a guarantee what holds of it.
struct Vcpu {
    VcpuId id = 0;
    Nanoseconds budget{};
    Nanoseconds period{};
    int core = kAnyCore;  ///< kAnyCore: wherever it fits (placement.h)
    VcpuKind kind = VcpuKind::main;
    /// A loop: how long a release may sleep before it ends, in `sleeps` sleeps at the most. Such a
    /// loop is deferrable.
    Nanoseconds suspension{};
    int sleeps = 1;
    /// A loop: its whole budget comes back at each release (deferrable_server.h).
    bool deferrable = false;
    /// An I/O VCPU: the period of the loop that it works for; 0: of any loop on its core.
    Nanoseconds client_period{};
    /// An I/O VCPU: the top halves of its edges take so much at a time, above every loop of its
    /// core, and come no closer than this. 0: none that the board does not count elsewhere.
    Nanoseconds edge_cost{};
    Nanoseconds edge_interval{};
    /// A loop: what its server has beside the budget, for the interrupts that the board charges to
    /// whom they interrupt (PlatformOverheads::victim_pays).
    Nanoseconds allowance{};
    /// Without a core of its choice: the cores that it is kept off, a bit for each.
    std::uint64_t kept_off = 0;

    [[nodiscard]] constexpr bool may_be_on(int number) const {
        return core == kAnyCore ? (kept_off >> number & 1u) == 0 : core == number;
    }
    [[nodiscard]] constexpr VcpuParameters parameters() const { return {budget, period}; }
    [[nodiscard]] constexpr bool is_io() const { return kind == VcpuKind::io; }
    /// How often a release gives the core up before it ends, because it sleeps.
    [[nodiscard]] constexpr int times_asleep() const { return suspension > Nanoseconds{0} ? sleeps : 0; }
};

/// Rate-monotonic, ties by id: the order of the loops of one core.
[[nodiscard]] constexpr bool ranks_above(const Vcpu& a, const Vcpu& b) {
    return a.period != b.period ? a.period < b.period : a.id < b.id;
}

}  // namespace qduino::sched
