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
// setup(), which is VCPU 0 here, and the handlers of an I/O VCPU make the second promise, too. Two
// or three relaxed stores each, and none where nobody watches.
#pragma once

#include <algorithm>
#include <array>

#include "board/linux/cycle_clock.h"
#include "board/linux/virtual_pins.h"

namespace qduino::board::linux {

/// A handler that runs for so long without progress() hangs.
inline constexpr Nanoseconds kHandlerLimit = 5s;

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
        pins_->promise(vcpu, std::min(std::max(t, cycle_clock.now()), kForever - bound_) + bound_);
    }

    /// `vcpu` (kNoVcpu: setup()) has got on. No effect beyond a sign of life while it has no limit.
    void progressed(VcpuId vcpu) {
        if (!watched_) return;
        const Instant now = cycle_clock.now();
        if (vcpu != kNoVcpu) pins_->promise(vcpu, now + bound_);
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

    /// I/O VCPU `io` has nothing to do, and waits.
    void idle(VcpuId io) {
        if (!watched_) return;
        promise(io, kForever);
        pins_->promise_progress(io, kEpoch, Nanoseconds{0});
    }

  private:
    /// So that an instant plus a limit does not overflow.
    static constexpr Nanoseconds kLongest = 1000h;

    VirtualPins* pins_ = nullptr;
    bool watched_ = false;
    Nanoseconds bound_{};
    std::array<Nanoseconds, kVcpuLimit> limits_{};
};

}  // namespace qduino::board::linux
