// How long the calling thread stood still though it wanted to run and no other had its core: its
// process was stopped or frozen, or its computer was.
//
//   sleeps ──────► alarm ······························ woke
//                        │ waited for a core │ stood still │
//
// What it waited for a core the kernel counts (schedstat). A stopped task waits for none.
#pragma once

#include <sys/types.h>

#include <utility>

#include "base/time.h"
#include "board/linux/kernel/thread_times.h"

namespace qduino::board::linux {

class Standstill {
  public:
    /// On the thread that is looked at. Where the kernel tells no times, nothing is ever seen.
    void begin(pid_t process, pid_t thread) {
        times_.close();
        told_ = times_.open(process, thread) && times_.read(then_);
    }
    /// It slept until `alarm`, and woke at `now`.
    void woke(Instant alarm, Instant now) {
        sched::ThreadTimes times = then_;
        if (!told_ || !times_.read(times)) return;
        const Nanoseconds still = now - alarm - (times.delayed - then_.delayed);
        then_ = times;
        if (still >= kLeast) seen_ += still;
    }
    /// Since the last call.
    [[nodiscard]] Nanoseconds take() { return std::exchange(seen_, Nanoseconds{0}); }

  private:
    /// Shorter ones are an interrupt's or the host's.
    static constexpr Nanoseconds kLeast{20'000'000};

    ThreadTimesFile times_;
    sched::ThreadTimes then_;
    Nanoseconds seen_{};
    bool told_ = false;
};

}  // namespace qduino::board::linux
