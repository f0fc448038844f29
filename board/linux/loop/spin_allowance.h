// Lets a loop spin on a core that it does not own, without a long pause from the kernel.
//
// Stock kernels keep back 5 % of every second from real-time threads (sched_rt_runtime_us; since
// Linux 6.12 the fair server, for tasks that wait). A thread that spins all the time gets that as
// one pause of 50 ms each second. Pauses that are short and frequent instead give the kernel no
// reason for its own:
//
//   all spun         ██████████████████████████ 950 ms ██████████████████████████|··50 ms··|███
//   with allowance   ██████·███████·██████████·███████·   0.1 ms now and then, inside long waits
//                                                         where there are any
//
// An account of running time fills at `share` of the time that passes, and running empties it.
// Above half full, the thread spins as it likes. Below half, it sleeps through waits that are long
// enough for a sleep. When the account is empty, it sleeps through any wait. A sleep ends before
// the instant that the loop waits for. Only the sleep of an empty account may pass it, by kForced.
//
// One thread. Time is a parameter.
#pragma once

#include <algorithm>

#include "base/time.h"

namespace qduino::board::linux {

class SpinAllowance {
  public:
    SpinAllowance() = default;  ///< for a core of its own: never sleeps

    /// The thread may run for `share` of the time: 0…1; 1 is all of it.
    SpinAllowance(double share, Instant now) : share_(share), seen_(now) {}

    [[nodiscard]] bool limited() const { return share_ < 1; }

    /// Call before a spin from `now` to `t`. Returns the instant until which to sleep first; `now`:
    /// no sleep.
    [[nodiscard]] Instant sleep_first(Instant now, Instant t) {
        ran(now);
        if (2 * left_ > kMost) return now;
        if (t - now > 2 * kWakeUp) return t - kWakeUp;
        return left_ > Nanoseconds{0} ? now : now + kForced;
    }
    /// The thread ran from the last call until now.
    void ran(Instant now) { account(now, false); }
    /// The thread slept from the last call until now.
    void slept(Instant now) { account(now, true); }

    /// The longest run at a stretch, after as long a rest.
    static constexpr Nanoseconds kMost = 20ms;
    /// How long before an instant a sleep ends, for the way out of it.
    static constexpr Nanoseconds kWakeUp = 150us;
    static constexpr Nanoseconds kForced = 60us;  ///< plus what waking takes: the pause

  private:
    void account(Instant now, bool was_asleep) {
        const double passed_ns = static_cast<double>((now - seen_).count());
        seen_ = now;
        const double change_ns = passed_ns * (was_asleep ? share_ : share_ - 1);
        left_ = std::min(kMost, left_ + Nanoseconds{static_cast<std::int64_t>(change_ns)});
    }

    double share_ = 1;
    Instant seen_{};
    Nanoseconds left_ = kMost;
};

}  // namespace qduino::board::linux
