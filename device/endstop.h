// Endstop: a mechanical switch, believed only once it has been steady.
//
//   contact  ____┌┐_┌──┐┌──────────────┐┌┐________
//   pressed  _________________┌──────────────┐____       a change is believed `steady` after its last bounce
//
// Invariants: `pressed` changes at most once in any `steady`; with steady = 0 it is the contact itself.
#pragma once

#include "base/time.h"

namespace qduino::device {

class Endstop {
  public:
    /// `steady` >= 0: how long the contact must not change before it is believed (a microswitch bounces 1–5
    /// ms).
    explicit constexpr Endstop(Nanoseconds steady = Nanoseconds{0}) : steady_(steady) {}

    /// One sample of the contact (true: closed); instants never go back. Returns whether the switch counts as
    /// pressed.
    constexpr bool sample(Instant now, bool contact) {
        if (contact != contact_) {
            contact_ = contact;
            changed_at_ = now;
        }
        if (contact_ != pressed_ && now - changed_at_ >= steady_) pressed_ = contact_;
        return pressed_;
    }
    [[nodiscard]] constexpr bool pressed() const { return pressed_; }

  private:
    Nanoseconds steady_;
    Instant changed_at_{};
    bool contact_ = false;
    bool pressed_ = false;
};

}  // namespace qduino::device
