// The scheduler of one core: rate-monotonic over main VCPUs (sporadic servers) and I/O VCPUs (PIBS).
//
// Rate-monotonic (Liu, Layland, JACM 1973): the shorter the period, the higher the priority; at equal periods
// the lower id. An I/O VCPU has, while it works, the period of the main VCPU that it works for (pibs.h).
//
//              wake  ┌──────────┐  decide  ┌─────────┐
//   blocked ────────►│ runnable │─────────►│ running │
//      ▲             └──────────┘◄─────────└─────────┘
//      │                preempted, throttled    │
//      └──────────────── block ─────────────────┘
//
// A throttled VCPU stays runnable; decide() skips it until its replenishment.
//
// Locks are the caller's; two things about them are this class's (L. Sha, R. Rajkumar, J. Lehoczky, "Priority inheritance
// protocols", IEEE Trans. Computers, 1990):
//   - inherit(): who holds a lock ranks as the highest of those who wait for it;
//   - set_holding(): who holds one is not throttled when its budget ends, or its waiters would wait for its
//     replenishment. It goes on for one budget more at most, charged forward as any overrun: what the others lose to it
//     within a period is bounded, and given back.
//
// The caller owns the clock: it calls decide(now), runs what it is told until `until` at the latest (or until
// something wakes or blocks), then calls again. Between two calls the VCPU last chosen is taken to have run
// all the time, but for what account() is told was taken from it.
//
// Invariants: at most one runs; it is the eligible runnable VCPU of highest priority at the last decide();
// every nanosecond that a VCPU ran is charged to its server, once.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>

#include "base/fixed_vector.h"
#include "base/time.h"
#include "sched/server.h"
#include "sched/vcpu.h"

namespace qduino::sched {

struct Decision {
    std::optional<VcpuId> vcpu;  ///< none: the core idles
    /// Decide again here at the latest: the chosen one's budget ends, or a replenishment may change the
    /// choice. kForever when only a wake or a block can.
    Instant until = kForever;
    bool operator==(const Decision&) const = default;
};

/// Who goes first: the smaller. A VCPU's own is its period and its id.
struct Rank {
    Nanoseconds period = Nanoseconds::max();
    VcpuId id = 0xff;
    constexpr auto operator<=>(const Rank&) const = default;
};

struct MainVcpuOptions {
    bool owns_core = false;  ///< never throttled (needs budget == period)
    SporadicServerOptions server{};
};

/// One owner at a time. No call blocks or allocates; each is O(VCPUs of the core).
/// Contract: `now` does not run backwards.
class CoreScheduler {
  public:
    CoreScheduler();

    /// Adds a blocked main VCPU with a full budget. False, and nothing changed, when the id is taken, the
    /// parameters are not valid, the table is full, or owns_core is asked with budget < period. Whether it
    /// is admitted, the caller has asked admission.h.
    [[nodiscard]] bool add(VcpuId id, VcpuParameters parameters, Instant now = kEpoch,
                           MainVcpuOptions options = {});
    /// Adds an idle I/O VCPU. False as above.
    [[nodiscard]] bool add_io(VcpuId id, VcpuParameters parameters, Instant now = kEpoch);

    /// Main VCPU `id` has work. No effect if it already had. For an I/O VCPU: work at its own period.
    void wake(VcpuId id, Instant now);
    /// I/O VCPU `id` has work on behalf of a main VCPU of period `client_period`, of this core or another.
    void wake_io(VcpuId id, Instant now, Nanoseconds client_period);
    /// As above, for a client on this core.
    void wake_io_for(VcpuId id, VcpuId client, Instant now);
    /// VCPU `id`, main or I/O, has no work left.
    void block(VcpuId id, Instant now);

    /// `id` ranks at least as high as `rank` from the next decide() on, until told otherwise (its own rank: no more).
    void inherit(VcpuId id, Rank rank);
    /// `id` holds a lock, or holds none any more. Charge what was stolen first.
    void set_holding(VcpuId id, bool holding, Instant now);

    /// Charges the running VCPU for the time since the last call, less `stolen` (interrupts that were served
    /// on the core meanwhile; 0 <= stolen <= the time passed). The calls above and decide() do it themselves
    /// with nothing stolen.
    void account(Instant now, Nanoseconds stolen = Nanoseconds{0});
    /// Who runs from `now` on. Accounts first.
    Decision decide(Instant now);

    /// The VCPU that the last decide() chose and that has not blocked since.
    [[nodiscard]] std::optional<VcpuId> running() const;
    /// Contract for all of these: `id` was added.
    [[nodiscard]] bool runnable(VcpuId id) const;  ///< has work, with or without budget
    /// Budget left at `now`, or, when that is spent and it holds a lock, what it may overrun; Nanoseconds::max() for an
    /// owning VCPU.
    [[nodiscard]] Nanoseconds available(VcpuId id, Instant now) const;
    [[nodiscard]] Instant next_replenishment(VcpuId id) const;
    [[nodiscard]] Nanoseconds consumed(VcpuId id) const;  ///< charged ever
    [[nodiscard]] bool contains(VcpuId id) const { return slots_[id] != kNoSlot; }
    [[nodiscard]] const Server& server(VcpuId id) const { return at(id).server; }

  private:
    struct Vcpu {
        VcpuId id = 0;
        bool owns_core = false;
        bool holding = false;
        Nanoseconds grace{};  // what it may still overrun while it holds a lock
        Rank inherited;
        Nanoseconds owned_consumed{};  // an owning VCPU has no server to charge
        Server server;
    };
    static constexpr std::size_t kLimit = kMainVcpuLimit + kIoVcpuLimit;
    static constexpr std::uint8_t kNoSlot = 0xff;

    [[nodiscard]] Vcpu& at(VcpuId id);
    [[nodiscard]] const Vcpu& at(VcpuId id) const;
    void insert(const Vcpu& vcpu);
    [[nodiscard]] static Rank rank_of(const Vcpu& vcpu);
    [[nodiscard]] static bool before(const Vcpu& a, const Vcpu& b);
    [[nodiscard]] static Nanoseconds budget_left(const Vcpu& vcpu, Instant now);
    [[nodiscard]] static Nanoseconds available(const Vcpu& vcpu, Instant now);
    static void charge(Vcpu& vcpu, Instant now, Nanoseconds used);
    [[nodiscard]] const Vcpu* highest(Instant now) const;
    [[nodiscard]] Instant next_change(const Vcpu* chosen, Instant now) const;

    FixedVector<Vcpu, kLimit> vcpus_;
    std::array<std::uint8_t, 256> slots_{};  // id → index in vcpus_
    std::uint8_t running_ = kNoSlot;
    std::size_t main_count_ = 0;
    std::size_t io_count_ = 0;
    Instant accounted_until_ = Instant::min();
};

}  // namespace qduino::sched
