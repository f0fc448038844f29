// What admission answers: admitted, with each loop's response time, or refused, with who takes the
// time and what would help.
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
    late_service,     ///< a bottom half's R for some client > that client's T: no share of U
    no_core_fits,     ///< asked for any core, and each one refuses it (placement.h)
};

/// Some R is above its T: a smaller request may help.
[[nodiscard]] constexpr bool is_late(RefusedBecause because) {
    return because == RefusedBecause::completion_time || because == RefusedBecause::late_service;
}

/// One loop's result. Also computed when the bound has decided, for the report.
struct LoopResponse {
    VcpuId id = 0;
    Nanoseconds response{};  ///< R; or a value beyond kResponseLimit·T when R is not below that
    Nanoseconds period{};    ///< T
    [[nodiscard]] bool meets() const { return response <= period; }
};

/// One bottom half's result, where it works for the usual client: pibs.h.
struct IoResponse {
    VcpuId id = 0;
    /// From when it has work and budget to the end of one service, at the most; beyond
    /// kResponseLimit·T as above.
    Nanoseconds response{};
    /// How long it may have to wait for its budget before that: the client's period T.
    Nanoseconds replenishment{};
};

/// One taker's share of a loop's time, within one window.
struct Share {
    enum class Kind : std::uint8_t { own, sleep, blocking, remote, main, io, platform, overhead };
    Kind kind = Kind::own;
    VcpuId id = 0;         ///< own, sleep, blocking, remote, main, io
    FixedString<23> name;  ///< platform
    Nanoseconds amount{};
    /// platform, where several events may come at once: what they take, and in millionths of the
    /// core what all take in the long run; 0: no more than one comes.
    Nanoseconds at_once{};
    std::int64_t long_run_ppm = 0;
};
using Shares = FixedVector<Share, kMainVcpuLimit + kIoVcpuLimit + 16>;

/// The smallest change that would be admitted, each alone; what is absent would not help.
struct Remedy {
    /// Least reduction of the refused loop's budget, whole µs.
    std::optional<Nanoseconds> budget_less_by;
    /// Least increase of its period, whole µs.
    std::optional<Nanoseconds> period_more_by;
    /// Lowest core that would take it as it is (placement.h).
    std::optional<int> other_core;
};

struct Refusal {
    RefusedBecause because = RefusedBecause::none;
    Vcpu vcpu;         ///< the VCPU refused, as asked
    VcpuId other = 0;  ///< core_owned: who owns it; duplicate_id: the same id
    /// For completion_time. For late_service it is the I/O VCPU's, with its client's period.
    LoopResponse response;
    VcpuKind late = VcpuKind::main;  ///< whose that is
    Shares shares;                   ///< of such: in that period; their sum exceeds it
    /// With which loops that loop shares locks across cores (remote_blocking.h).
    FixedVector<VcpuId, kMainVcpuLimit> sharers;
    Remedy remedy;
};

struct Admission {
    bool admitted = false;
    AdmittedBy by = AdmittedBy::bound;
    int core = 0;
    std::int64_t utilisation_ppm = 0;                 ///< left side of the bound, to the nearest
    std::int64_t bound_ppm = 0;                       ///< n(2^(1/n) − 1), rounded down
    FixedVector<LoopResponse, kMainVcpuLimit> loops;  ///< by priority, highest first
    FixedVector<IoResponse, kIoVcpuLimit> ios;        ///< in the order of the request; none where
                                                      ///< no loop is on the core
    Refusal refusal;                                  ///< because == none when admitted
};

}  // namespace qduino::sched
