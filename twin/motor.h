// Motor: does the rotor follow this microstep? The pull-in and pull-out limits of a stepper, from
// its step times.
//
// A rotor hangs on its field by an elastic torque. It may lag by up to one full step and still be
// pulled along, so a single late or early microstep harms nothing. But it cannot change its mean
// speed faster than its torque allows. So speed is taken over windows of one full step (M
// microsteps, 16 here):
//
//      t[i−2M] ………………… t[i−M] ………………… t[i]
//         └── before: M/Δt ──┘└── now: M/Δt ──┘
//
//   follows  ⇔  now <= pull_out  and  now <= before + pull_in + acceleration · (t[i] − t[i−2M]) / 2
//
// `before` is 0 where the run has no second window: after power-on, and after a reversal. That
// makes pull_in the speed that the motor starts at from rest. Braking is not judged: a step train
// that stops shows nothing on its pins. A motor that fell out stays out until the field turns
// slower than pull_in, or turns back.
//
// Invariant: a train that never exceeds pull_in loses nothing, whatever its gaps. The reference
// machine's 125 mm/s is 10 000 microsteps/s, below the default pull-in of 12 000. So lateness
// stretches a print and does not spoil it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "base/contract.h"
#include "base/time.h"
#include "twin/machine.h"

namespace qduino::twin {

class Motor {
  public:
    explicit Motor(const MotorSpec& spec)
        : spec_(spec), window_(static_cast<std::uint64_t>(spec.microsteps)) {
        QDUINO_EXPECT(spec.microsteps >= 1 && 2 * spec.microsteps <= static_cast<int>(kHistory));
        QDUINO_EXPECT(spec.pull_in_steps_s > 0 && spec.pull_out_steps_s > 0 &&
                      spec.acceleration_steps_s2 >= 0);
        // Twice the window at this spacing can break no rule, so one comparison judges most steps
        // of a print.
        harmless_span_ns_ = static_cast<std::int64_t>(static_cast<double>(window_) * 1e9 /
                                                      std::min(spec.pull_in_steps_s, spec.pull_out_steps_s));
    }

    /// The field made one microstep at `now` towards `direction` (+1 or −1). False when the rotor
    /// did not follow.
    [[nodiscard]] bool follows(Instant now, int direction) {
        if (direction != direction_) {
            direction_ = direction;
            run_ = 0;
        }
        const std::int64_t now_ns = to_ns(now);
        times_[run_ % kHistory] = now_ns;
        const std::uint64_t index = run_++;
        if (index < window_) return true;
        const std::int64_t span_ns = now_ns - times_[(index - window_) % kHistory];
        if (span_ns >= harmless_span_ns_) [[likely]] {
            stalled_ = false;
            return true;
        }
        return judge(index, span_ns);
    }

  private:
    static constexpr std::uint64_t kHistory = 64;

    [[nodiscard]] double rate(std::int64_t span_ns) const {
        return static_cast<double>(window_) * 1e9 / static_cast<double>(std::max<std::int64_t>(span_ns, 1));
    }
    [[nodiscard]] bool judge(std::uint64_t index, std::int64_t span_ns) {
        const double now = rate(span_ns);
        double before = 0;
        std::int64_t spans_ns = 2 * span_ns;  // a rotor at rest: as long again is granted
        if (index >= 2 * window_) {
            const std::int64_t middle_ns = times_[(index - window_) % kHistory];
            const std::int64_t before_ns = middle_ns - times_[(index - 2 * window_) % kHistory];
            before = stalled_ ? 0 : rate(before_ns);
            spans_ns = span_ns + before_ns;
        }
        const double allowed = before + spec_.pull_in_steps_s +
                               spec_.acceleration_steps_s2 * static_cast<double>(spans_ns) * 0.5e-9;
        stalled_ = stalled_ ? now > spec_.pull_in_steps_s : now > std::min(allowed, spec_.pull_out_steps_s);
        return !stalled_;
    }

    MotorSpec spec_;
    std::uint64_t window_;
    std::int64_t harmless_span_ns_ = 0;
    std::array<std::int64_t, kHistory> times_{};  // of the present run, by index modulo kHistory
    std::uint64_t run_ = 0;
    int direction_ = 0;
    bool stalled_ = false;
};

}  // namespace qduino::twin
