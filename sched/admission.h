// Admission: may these VCPUs share one core, and every loop still get its budget in every period?
//
// In this order, and exactly, in integers (ARCHITECTURE.md, "VCPUs and admission"):
//
//   0. owned            A loop with budget == period on a core that it names owns that core:
//                       admitted when alone there, refused beside another.
//   1. bound            Σ C/T + Σ (2 − U)·U  <=  n(2^(1/n) − 1)     n main VCPUs; U of I/O VCPUs
//                       Liu, Layland, JACM 1973; the I/O term: Danish, Li, West, RTAS 2011. Decided
//                       as (1 + u/n)^n <= 2 in fixed point with every rounding upwards: it never
//                       admits wrongly; what it misses by less than 2^-48, the next test decides.
//   2. completion time  R = C + Σ_{j in hp(i)} ⌈R/T_j⌉·C_j
//                       + Σ_{k in I/O} (D_k + U_k·(R − D_k))  <=  T_i
//                       Joseph, Pandya, Computer Journal 1986; completion_time.h has all of it.
//   3. services         Whichever loop of the core a bottom half works for: a service of U·T that
//                       may begin ends within T. So the share is had, and not only declared.
//
// Both count the platform's overheads. Each activation of a VCPU costs a release and an enforcement
// more than its budget. Interferers that no VCPU controls (interrupt threads, the kernel's fair
// server) come above everything: in a window w each takes ⌈(w + jitter)/interval⌉·cost. They are
// not rate-monotonic, so the bound takes them as blocking, max_i interference(T_i)/T_i (Sha,
// Rajkumar, Lehoczky, IEEE ToC 1990).
//
// Golden case: (30,100), (20,100), (4,10) ms. U = 0.90 > 0.780: the bound says no. R = 86 <= 100:
// completion time says yes.
#pragma once

#include <span>

#include "sched/load.h"
#include "sched/verdict.h"

namespace qduino::sched {

/// May `load` share a core? Setup-time: the analysis is pseudo-polynomial (microseconds as a rule),
/// and a refusal's search for a remedy runs it some thousand times. Remedy::other_core is left to
/// admit_all().
[[nodiscard]] Admission admit(const CoreLoad& load);

/// Judges as admit() does, and looks for no remedy.
[[nodiscard]] Admission admit_without_remedy(const CoreLoad& load);

/// The answer alone, at the least cost.
[[nodiscard]] bool is_admissible(const CoreLoad& load);

/// The same of all cores of a computer: waits for locks of other cores are counted anew first
/// (CoreLoad::waits).
[[nodiscard]] bool are_admissible(std::span<CoreLoad> loads);

/// R of `budget` below all loops and bottom halves of `load`, in a period of at most `limit`;
/// beyond `limit` when it is above that, or when the analysis takes no more VCPUs.
[[nodiscard]] Nanoseconds response_below_all(const CoreLoad& load, Nanoseconds budget, Nanoseconds limit);

/// What was promised below all loops (PlatformOverheads::below) gets its budget in each period.
[[nodiscard]] bool keeps_promise_below(const CoreLoad& load);

/// Step 1 alone: utilisation against the bound.
[[nodiscard]] bool admitted_by_bound(const CoreLoad& load);

}  // namespace qduino::sched
