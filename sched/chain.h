// End-to-end times of a chain of VCPUs: how long an event may wait for the output that answers it
// (reaction), and how old the data may be on which an output rests (age).
//
//   event   loop 1 ─► data ─► loop 2 ─► output
//     │     T₁                T₂
//     ├────►│ release 1       │
//     │     ├── R₁ ──┤        │
//     │     └── D(1,2) ──────►│ release 2
//     │                       ├── R₂ ──┤
//     └────────── reaction ────────────┘      T₁ + D(1,2) + R₂
//           └─────── age ──────────────┘           A(1,2) + R₂
//
// A release may read at any time from its begin on, and has written when it ends. So an event that
// just missed a release is read by the next one, and what a release writes is read by the first
// release of the next loop that begins behind its end:
//
//   D(i,j) = T_j            where i and j share a core and i ranks above j: what j's release could
//                           read too early is not there, because i is done before j begins
//          = R_i + T_j      elsewhere
//   A(i,j) = T_i, R_i + T_i in the same cases: the data is from the last release of i that surely
//                           ended before j began; over a ring buffer that j drains at each release
//                           the oldest item has waited for D(i,j), and the greater one counts
//
// All releases are whole periods away from one origin (runtime/release_clock.h). So the distance of
// two releases is a multiple of gcd(T_i, T_j), and each of these is rounded down to one.
//
// The sum of T + R: Davare et al., DAC 2007. The case of one core: Dürr, von der Brüggen, Chen,
// Chen, ACM TECS 2019. That age and reaction differ by one period of the first stage and the last
// one's: Günzel et al., ECRTS 2023.
//
// A chain may begin with a bottom half, whose work begins with the edge: it waits for no period.
// The next loop waits for its end, R of the I/O VCPU and what that waits for budget. Data that is
// no older than an edge has no age: it holds until the next edge.
#pragma once

#include <span>

#include "base/fixed_vector.h"
#include "sched/placement.h"

namespace qduino::sched {

inline constexpr std::size_t kChainStageLimit = 8;

struct ChainStage {
    VcpuId vcpu = 0;
    /// The longest pass of a loop that owns its core and waits for no period. 0: the loop waits for
    /// its periods.
    Nanoseconds pass{};
    /// It takes from the stage before through a ring buffer, which it drains at each release.
    bool queued = false;
};
using ChainStages = FixedVector<ChainStage, kChainStageLimit>;

enum class ChainFault : std::uint8_t {
    none,
    no_such_vcpu,   ///< nothing of this number runs
    io_behind,      ///< an I/O VCPU can only be the first stage
    no_period,      ///< a pass is named of a loop that does not own its core
    never_in_time,  ///< this VCPU has no response time
};

struct ChainBound {
    ChainFault fault = ChainFault::none;
    VcpuId at = 0;  ///< where the fault is
    Nanoseconds reaction{};
    Nanoseconds age{};  ///< from the begin of the release that reads first; not of one with an edge
    bool has_age = true;
    /// For each stage, how long its release comes after that of the stage before it (for the first
    /// stage, after the event).
    FixedVector<Nanoseconds, kChainStageLimit> reaction_steps, age_steps;
    /// From the release of the last stage to its end.
    Nanoseconds last{};

    [[nodiscard]] bool known() const { return fault == ChainFault::none; }
};

/// What a chain may take; 0: as long as it likes.
struct ChainLimits {
    Nanoseconds reaction{};
    Nanoseconds age{};
    [[nodiscard]] bool hold(const ChainBound& bound) const {
        return bound.known() && (reaction == Nanoseconds{0} || bound.reaction <= reaction) &&
               (age == Nanoseconds{0} || bound.age <= age);
    }
};

/// The bound of a chain of loops and bottom halves as they were admitted. Contract: there is a
/// stage.
[[nodiscard]] ChainBound bound_of(const MulticoreAdmission& admission, const ChainStages& stages);

/// The longest period of the loop `id`, all else unchanged, with which every loop is admitted and
/// the chain keeps `limits`, to the microsecond; 0: none found. It looks for a limit first, and
/// then among whole multiples and parts of other periods, which make chains short. `scratch` is a
/// copy of an admission, and is as before at the end. Setup-time: some hundred analyses.
[[nodiscard]] Nanoseconds longest_period(MulticoreAdmission& scratch, const ChainStages& stages,
                                         const ChainLimits& limits, VcpuId id);

}  // namespace qduino::sched
