// Signs of life for the supervisor: by when each loop will be heard of again.
//
// A loop that waits, or spins, says until when. One that is not heard of for `bound` after that is
// taken for hung. One relaxed store each, and none where nobody watches.
#pragma once

#include <algorithm>

#include "board/linux/cycle_clock.h"
#include "board/linux/virtual_pins.h"

namespace qduino::board::linux {

class SignsOfLife {
  public:
    SignsOfLife() = default;  ///< nobody watches
    /// `configured`: the least that is taken for a hang; the supervisor may ask for more.
    SignsOfLife(VirtualPins& pins, Nanoseconds configured)
        : pins_(&pins),
          watched_(pins.heartbeat_bound() > Nanoseconds{0}),
          bound_(std::max(configured, pins.heartbeat_bound())) {}

    /// `vcpu` (none: no effect) will be heard of at `t`, or at once when that has passed; kForever:
    /// it waits for something to happen.
    void promise(VcpuId vcpu, Instant t) {
        if (!watched_ || vcpu == kNoVcpu) return;
        pins_->promise(vcpu, std::min(std::max(t, cycle_clock.now()), kForever - bound_) + bound_);
    }

  private:
    VirtualPins* pins_ = nullptr;
    bool watched_ = false;
    Nanoseconds bound_{};
};

}  // namespace qduino::board::linux
