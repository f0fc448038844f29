// How a loop spins on a core that it does not have to itself: with pauses so short and so many that the kernel makes none of its own.
//
// Stock kernels keep back 5 % of every second from real-time threads (sched_rt_runtime_us; since Linux 6.12 the fair server, for
// tasks that wait). A thread that spins through meets that as one pause of 50 ms each second:
//
//   spun through      ██████████████████████████ 950 ms ██████████████████████████|··50 ms··|███
//   with allowance    ██████·███████·██████████·███████·   0.1 ms now and then, in waits that are long enough where there are any
//
// An account of running time, filled at `share` of the time that passes and emptied by what was run: with more than half in it nothing
// is done; below that, waits long enough to sleep through are slept through; when it is empty, any wait is. A sleep ends before the
// instant that is waited for, except for those of the empty account, which may pass it by kForced.
//
// One thread. Time is a parameter.
#pragma once

#include <algorithm>

#include "base/time.h"

namespace qduino::board::linux {

class SpinAllowance {
  public:
    SpinAllowance() = default;  ///< for a core of its own: never sleeps

    /// `share`: of the time that the thread may run, 0…1; 1: all of it.
    SpinAllowance(double share, Instant now) : share_(share), seen_(now) {}

    [[nodiscard]] bool limited() const { return share_ < 1; }

    /// About to spin from `now` to `t`: until when to sleep first; `now` for not at all.
    [[nodiscard]] Instant sleep_first(Instant now, Instant t) {
        ran(now);
        if (2 * left_ > kMost) return now;
        if (t - now > 2 * kWakeUp) return t - kWakeUp;
        return left_ > Nanoseconds{0} ? now : now + kForced;
    }
    /// Until now the thread ran, since the last call.
    void ran(Instant now) { account(now, false); }
    /// Until now it slept, since the last call.
    void slept(Instant now) { account(now, true); }

    static constexpr Nanoseconds kMost = 20ms;     ///< what can be run at a stretch, after as long a rest
    static constexpr Nanoseconds kWakeUp = 150us;  ///< before an instant, for the way out of a sleep
    static constexpr Nanoseconds kForced = 60us;   ///< and what waking takes is the pause

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
