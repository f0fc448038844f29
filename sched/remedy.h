// The search for the smallest change that would be admitted, in whole microseconds.
//
// Less budget never hurts: the analysis is sustainable in C (Baruah, Burns, RTSS 2006), so
// bisection finds the least reduction. A longer period never hurts either while there are no I/O
// VCPUs, because rate-monotonic order is optimal: the set stays schedulable in the old order, hence
// in the new one. With I/O VCPUs, whose budget grows with their client's period, it may hurt by a
// little; then the nearest periods are tried one by one (as many as a bounded amount of work
// allows: ten milliseconds' worth for a sketch of a few loops), and only what lies beyond is
// bisected.
#pragma once

#include <span>

#include "sched/load.h"
#include "sched/verdict.h"

namespace qduino::sched {

/// The smallest changes to VCPU `id` of the refused `loads[core]` that make it admissible, and the
/// others where locks cross cores. Remedy::other_core is left to admit_all(). `loads` is changed
/// meanwhile, and at the end as it was.
[[nodiscard]] Remedy smallest_change(std::span<CoreLoad> loads, std::size_t core, VcpuId id);

}  // namespace qduino::sched
