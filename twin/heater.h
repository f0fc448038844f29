// Heater: a heated block that loses heat to the room, and a sensor that lags behind it. Solved
// exactly, not stepped.
//
//   C dT/dt = P·duty − G·(T − T_room)          block        τb = C/G
//   τs dS/dt = T − S                           sensor
//
// Between two accesses duty and G are constant, so both have a closed form (T∞ = T_room + P·duty/G,
// D = T₀ − T∞):
//
//   T(t) = T∞ + D e^(−t/τb)
//   S(t) = T∞ + k D e^(−t/τb) + (S₀ − T∞ − k D) e^(−t/τs),      k = τb / (τb − τs)
//
// An access costs two exponentials, and there are no events in between: 5000 s of print are 0.1 s
// of work. Invariants: time never goes back; T tends to T∞ and never past it; advancing by a + b
// equals advancing by a, then b.
#pragma once

#include <cmath>

#include "base/contract.h"
#include "base/time.h"
#include "twin/machine.h"

namespace qduino::twin {

class Heater {
  public:
    Heater(const HeaterSpec& spec, double room_celsius)
        : spec_(spec),
          room_celsius_(room_celsius),
          block_celsius_(room_celsius),
          sensor_celsius_(room_celsius) {
        QDUINO_EXPECT(spec.heat_capacity_j_k > 0 && spec.loss_w_k > 0 && spec.sensor_lag_s > 0);
    }

    /// Brings block and sensor to `now`. An earlier instant changes nothing.
    void advance(Instant now) {
        if (now <= at_) return;
        const double seconds = to_seconds(now - at_);
        at_ = now;
        const double loss_w_k = spec_.loss_w_k * (1.0 + spec_.fan_loss_share * fan_duty_);
        double block_s = spec_.heat_capacity_j_k / loss_w_k;
        // The closed form needs two different time constants. Moving one by a hair is the same
        // physics.
        if (std::abs(block_s - spec_.sensor_lag_s) < 1e-6 * block_s) block_s *= 1.0 + 1e-5;
        const double settled = room_celsius_ + spec_.power_w * power_share() / loss_w_k;
        const double k = block_s / (block_s - spec_.sensor_lag_s);
        const double gap = block_celsius_ - settled;
        const double block_decay = std::exp(-seconds / block_s);
        const double sensor_decay = std::exp(-seconds / spec_.sensor_lag_s);
        block_celsius_ = settled + gap * block_decay;
        sensor_celsius_ =
            settled + k * gap * block_decay + (sensor_celsius_ - settled - k * gap) * sensor_decay;
    }

    /// The heater's switch from `now` on, 0…1.
    void set_duty(Instant now, double duty) {
        advance(now);
        if (duty <= 0 && duty_ > 0) off_since_ = now;
        duty_ = duty;
    }
    void set_fan(Instant now, double duty) {
        advance(now);
        fan_duty_ = duty;
    }
    /// `volume_mm3` of plastic was melted just now: it took its heat from the block.
    void melt(double volume_mm3) {
        block_celsius_ -=
            (block_celsius_ - room_celsius_) * volume_mm3 * spec_.plastic_j_mm3_k / spec_.heat_capacity_j_k;
    }

    // Faults. The caller advances to the fault's instant first.
    void set_connected(bool connected) { connected_ = connected; }
    void set_stuck_on(bool stuck_on) { stuck_on_ = stuck_on; }

    /// The values at the last advance.
    [[nodiscard]] double block_celsius() const { return block_celsius_; }
    [[nodiscard]] double sensor_celsius() const { return sensor_celsius_; }
    /// The duty that the board drives, whatever a fault makes of it.
    [[nodiscard]] double duty() const { return duty_; }
    /// The instant at which it was last switched off; the epoch: it never was on. Meaningless while
    /// it is on.
    [[nodiscard]] Instant off_since() const { return off_since_; }
    /// The share of the power that really heats, 0…1.
    [[nodiscard]] double power_share() const { return !connected_ ? 0.0 : stuck_on_ ? 1.0 : duty_; }

  private:
    HeaterSpec spec_;
    double room_celsius_;
    double block_celsius_;
    double sensor_celsius_;
    Instant off_since_{};
    double duty_ = 0;
    double fan_duty_ = 0;
    bool connected_ = true;
    bool stuck_on_ = false;
    Instant at_{};
};

}  // namespace qduino::twin
