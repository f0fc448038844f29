// Admission: may these VCPUs share one core, and every loop still get its budget in every period?
//
// In this order, and exactly, in integers (ARCHITECTURE.md, "VCPUs and admission"):
//
//   0. owned            A loop with budget == period on a core it names owns that core: admitted when alone
//                       there, refused beside another.
//   1. bound            Σ C/T + Σ (2 − U)·U  <=  n(2^(1/n) − 1)            n main VCPUs; U of I/O VCPUs
//                       Liu, Layland, JACM 1973; the I/O term: Danish, Li, West, RTAS 2011. Decided as
//                       (1 + u/n)^n <= 2 in fixed point with every rounding upwards: it never admits wrongly;
//                       what it misses by less than 2^-48, the next test decides.
//   2. completion time  R = C + Σ_{j in hp(i)} ⌈R/T_j⌉·C_j
//                         + Σ_{k in I/O} max_{q in hep(i)} (1 + ⌈(R − U_k·T_q)/T_q⌉)·U_k·T_q   <=  T_i
//                       Joseph, Pandya, Computer Journal 1986; Missimer, Zhao, West, ECRTS 2016.
//
// What the platform takes is in both. Each activation of a VCPU costs a release and an enforcement more than
// its budget. Interferers that no VCPU controls (interrupt threads, the kernel's fair server) come above
// everything: in a window w each takes ⌈(w + jitter)/interval⌉·cost. They are not rate-monotonic, so the bound
// takes them as blocking, max_i interference(T_i)/T_i (Sha, Rajkumar, Lehoczky, IEEE ToC 1990).
//
// Golden case: (30,100), (20,100), (4,10) ms. U = 0.90 > 0.780: the bound says no. R = 86 <= 100: completion
// time says yes.
#pragma once

#include <cstdint>
#include <optional>

#include "base/fixed_string.h"
#include "base/fixed_vector.h"
#include "base/time.h"
#include "sched/vcpu.h"

namespace qduino::sched {

/// A response time beyond this many periods is not followed further: it is "never".
inline constexpr std::int64_t kResponseLimit = 16;

/// A VCPU that asks to be admitted.
struct VcpuRequest {
    VcpuId id = 0;
    VcpuParameters parameters;
    int core = kAnyCore;  ///< kAnyCore: wherever it fits (placement.h)
    bool io = false;      ///< an I/O VCPU (PIBS)
};

/// What takes a core's time above every VCPU: an interrupt thread, the kernel's fair server, top halves.
struct PlatformInterferer {
    FixedString<23> name;
    Nanoseconds cost{};      ///< CPU time per event
    Nanoseconds interval{};  ///< shortest time between two events in the long run; > 0 when cost > 0
    Nanoseconds jitter{};    ///< how much closer than that two events may come

    /// Most it can take in a window of length `window`.
    [[nodiscard]] Nanoseconds interference(Nanoseconds window) const;
};

/// Measured by a board; zero in the simulator unless configured.
struct PlatformOverheads {
    Nanoseconds release_cost{};      ///< wake-up and two context switches, per activation
    Nanoseconds enforcement_cost{};  ///< budget timer and its handler, per activation
    FixedVector<PlatformInterferer, 8> interferers;
};

/// All that is to run on one core.
struct CoreLoad {
    int core = 0;
    FixedVector<VcpuRequest, kMainVcpuLimit> mains;
    FixedVector<VcpuRequest, kIoVcpuLimit> ios;
    PlatformOverheads overheads;

    /// False when the table is full.
    [[nodiscard]] bool try_add(const VcpuRequest& request) {
        return request.io ? ios.try_push_back(request) : mains.try_push_back(request);
    }
};

enum class AdmittedBy : std::uint8_t { bound, completion_time, owned };

enum class RefusedBecause : std::uint8_t {
    none,             ///< admitted
    bad_parameters,   ///< not 0 < budget <= period <= kPeriodMax
    duplicate_id,     ///< two VCPUs of one core have the same id
    core_owned,       ///< another loop owns the core
    no_such_core,     ///< the core that it names does not exist (placement.h)
    too_many,         ///< more VCPUs than a core takes
    io_overload,      ///< no loops, and the I/O VCPUs alone ask for more than the core
    completion_time,  ///< R > T
    no_core_fits,     ///< asked for any core, and each one refuses it (placement.h)
};

/// One loop's result. Also computed when the bound has decided, for the report.
struct LoopResponse {
    VcpuId id = 0;
    Nanoseconds response{};  ///< R; or, when there is none up to kResponseLimit·T, a value beyond that
    Nanoseconds period{};    ///< T
    bool meets = false;      ///< R <= T
};

/// Who takes how much of a loop's time, within one window.
struct Share {
    enum class Kind : std::uint8_t { own, main, io, platform, overhead };
    Kind kind = Kind::own;
    VcpuId id = 0;         ///< own, main, io
    FixedString<23> name;  ///< platform
    Nanoseconds amount{};
};
using Shares = FixedVector<Share, kMainVcpuLimit + kIoVcpuLimit + 10>;

/// The smallest change that would be admitted, each alone; what is absent would not help.
struct Remedy {
    std::optional<Nanoseconds> budget_less_by;  ///< least reduction of the refused loop's budget, whole µs
    std::optional<Nanoseconds> period_more_by;  ///< least increase of its period, whole µs
    std::optional<int> other_core;              ///< lowest core that would take it as it is (placement.h)
};

struct Refusal {
    RefusedBecause because = RefusedBecause::none;
    VcpuId id = 0;     ///< the VCPU refused
    bool io = false;   ///< it is an I/O VCPU
    VcpuId other = 0;  ///< core_owned: who owns it; duplicate_id: the same id
    VcpuParameters parameters;
    LoopResponse response;  ///< completion_time
    Shares shares;          ///< completion_time: in one period of that loop; their sum exceeds it
    Remedy remedy;
};

struct Admission {
    bool admitted = false;
    AdmittedBy by = AdmittedBy::bound;
    int core = 0;
    std::int64_t utilisation_ppm = 0;                 ///< left side of the bound, to the nearest
    std::int64_t bound_ppm = 0;                       ///< n(2^(1/n) − 1), rounded down
    FixedVector<LoopResponse, kMainVcpuLimit> loops;  ///< by priority, highest first
    Refusal refusal;                                  ///< because == none when admitted
};

/// May `load` share a core? Setup-time: the analysis is pseudo-polynomial (microseconds as a rule), and a
/// refusal's search for a remedy runs it some thousand times. Remedy::other_core is left to admit_all().
[[nodiscard]] Admission admit(const CoreLoad& load);

/// As admit(), without looking for a remedy.
[[nodiscard]] Admission admit_without_remedy(const CoreLoad& load);

/// The answer alone, at the least cost.
[[nodiscard]] bool is_admissible(const CoreLoad& load);

/// The smallest changes to VCPU `id` of a refused `load` that make it admissible (remedy.cpp says how far they
/// are proven the smallest). Remedy::other_core is left to admit_all().
[[nodiscard]] Remedy smallest_change(const CoreLoad& load, VcpuId id);

/// Step 1 alone: utilisation against the bound.
[[nodiscard]] bool admitted_by_bound(const CoreLoad& load);

/// Step 2 for one loop. Contract: `id` is a main VCPU of `load`.
[[nodiscard]] LoopResponse completion_time(const CoreLoad& load, VcpuId id);

/// What takes the time of loop `id` in a window of length `window` from its release on: its own budget, each
/// VCPU of higher priority, each I/O VCPU, the platform. In a window of length R the sum is R.
[[nodiscard]] Shares shares_in_window(const CoreLoad& load, VcpuId id, Nanoseconds window);

}  // namespace qduino::sched
