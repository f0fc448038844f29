// Signs of life for the supervisor: by when each loop will be heard of again, and by when it will
// have got on.
//
// A loop that waits, or spins, says until when. One that is not heard of for `bound` after that is
// taken for hung. But a loop that polls for ever with a delay(1) is heard of all the time, and one
// in a delay() of ten hours has said so. So there is a second promise:
//
//   heard of   every wait, spin and release      silent for `bound` beyond what it announced
//   got on     a release, or progress()          none for the loop's own limit
//
// A loop that has spent its budget is not let run until a replenishment, which may be far away: a
// loop of 0.1 ms in a second that takes 0.2 ms once is silent for a second, and does not hang. So
// the sleep for a spent budget prolongs the first promise. A spin without end has such sleeps, too,
// one after the other; therefore only the first few count, from one sign of life to the next.
//
// setup(), which is VCPU 0 here, and the handlers of an I/O VCPU make the second promise, too. Two
// or three relaxed stores each, and none where nobody watches.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>

#include "board/linux/kernel/cycle_clock.h"
#include "board/linux/pin/virtual_pins.h"

namespace qduino::board::linux {

/// A handler that runs for so long without progress() hangs.
inline constexpr Nanoseconds kHandlerLimit = 5s;

/// So many sleeps for a spent budget prolong the promise of one sign of life.
inline constexpr int kSleepsThatCount = 4;

class SignsOfLife {
  public:
    SignsOfLife() = default;  ///< nobody watches
    /// `configured`: the least that is taken for a hang; the supervisor may ask for more.
    SignsOfLife(VirtualPins& pins, Nanoseconds configured)
        : pins_(&pins),
          watched_(pins.heartbeat_bound() > Nanoseconds{0}),
          bound_(std::max(configured, pins.heartbeat_bound())) {
        std::fill(limits_.begin() + kFirstIoVcpu, limits_.end(), std::max(kHandlerLimit, bound_));
    }

    /// `vcpu` (none: no effect) will be heard of at `t`, or at once when that has passed; kForever:
    /// it waits for something to happen.
    void promise(VcpuId vcpu, Instant t) {
        if (!watched_ || vcpu == kNoVcpu) return;
        heard_of(vcpu, std::min(std::max(t, cycle_clock.now()), kForever - bound_));
    }

    /// The budget of loop `vcpu` is spent, and it sleeps until `t`. By its thread, also in the
    /// handler of a signal.
    void sleeps_for_budget(VcpuId vcpu, Instant t) {
        if (!watched_ || vcpu == kNoVcpu) return;
        const std::atomic_ref<int> slept{slept_[vcpu]};
        const int before = slept.load(std::memory_order_relaxed);
        if (before >= kSleepsThatCount) return;
        slept.store(before + 1, std::memory_order_relaxed);
        pins_->prolong(vcpu, t + bound_);
    }

    /// `vcpu` (kNoVcpu: setup()) has got on. No effect beyond a sign of life while it has no limit.
    void progressed(VcpuId vcpu) {
        if (!watched_) return;
        const Instant now = cycle_clock.now();
        if (vcpu != kNoVcpu) heard_of(vcpu, now);
        if (const Nanoseconds limit = limits_[vcpu]; limit > Nanoseconds{0})
            pins_->promise_progress(vcpu, now + limit, limit);
    }

    /// `vcpu` gets on every `limit`, which is raised to the bound; 0: it promises nothing, and an
    /// earlier promise is taken back. For loops and kNoVcpu.
    void limit_progress(VcpuId vcpu, Nanoseconds limit) {
        if (!watched_) return;
        limits_[vcpu] = limit > Nanoseconds{0} ? std::min(std::max(limit, bound_), kLongest) : Nanoseconds{0};
        if (limit <= Nanoseconds{0}) pins_->promise_progress(vcpu, kEpoch, Nanoseconds{0});
    }

    /// `vcpu` has nothing to do: it waits for edges, or has returned.
    void idle(VcpuId vcpu) {
        if (!watched_) return;
        promise(vcpu, kForever);
        pins_->promise_progress(vcpu, kEpoch, Nanoseconds{0});
    }

  private:
    /// So that an instant plus a limit does not overflow.
    static constexpr Nanoseconds kLongest = 1000h;

    void heard_of(VcpuId vcpu, Instant t) {
        std::atomic_ref<int>{slept_[vcpu]}.store(0, std::memory_order_relaxed);
        pins_->promise(vcpu, t + bound_);
    }

    VirtualPins* pins_ = nullptr;
    bool watched_ = false;
    Nanoseconds bound_{};
    std::array<Nanoseconds, kVcpuLimit> limits_{};
    /// How often each VCPU has slept for a spent budget since its last sign of life, counted up to
    /// kSleepsThatCount. Its thread writes it, and so does the handler that interrupts the thread.
    std::array<int, kVcpuLimit> slept_{};
};

}  // namespace qduino::board::linux
