// M303: finds PID gains by making the heater swing.
//
//   celsius      .-.       .-.        amplitude a = (max − min)/2
//   target ─────/───\─────/───\───
//           ___/     '-_-'            duty  b + d while it heats, b − d while it cools
//                |<-- Tu -->|         ultimate gain Ku = 4d / (π·a)
//
// A relay instead of a controller makes a heater oscillate at the very frequency at which control
// would become unstable (K. Åström, T. Hägglund, Automatica 20, 1984). Gains follow from Ku and Tu
// by the rule of Ziegler and Nichols (1942): Kp = 0.6 Ku, Ti = Tu/2, Td = Tu/8. A bed is to creep
// up rather than to overshoot, as nothing cools it: 0.2 Ku, Tu/2, Tu/3 (the no-overshoot rule).
//
// A heater that holds its target with little power cools slower than it heats, and the swing is
// lopsided. So b moves until both halves take equally long, and the first two swings do not count.
// Gains are in Marlin's units: 255 is full duty. Pure.
#pragma once

#include <algorithm>
#include <numbers>

namespace qduino::printer::heat {

struct TunedGains {
    double kp = 0, ki = 0, kd = 0;
};

class PidTuning {
  public:
    static constexpr int kFewestSwings = 3;

    /// `swings` are counted, those that do not count among them.
    PidTuning(double target_celsius, int swings, bool is_bed)
        : target_(target_celsius), swings_(std::max(swings, kFewestSwings)), is_bed_(is_bed) {}

    /// One sample, `dt_s` after the last. Returns the duty, 0…1.
    [[nodiscard]] double sample(double celsius, double dt_s) {
        since_turn_s_ += dt_s;
        highest_ = std::max(highest_, celsius);
        lowest_ = std::min(lowest_, celsius);
        // Noise on the converter's last bit is no turn.
        if (since_turn_s_ > kShortestHalf && heats_ == (celsius > target_)) turn();
        return done() ? 0 : heats_ ? middle_ + half_ : middle_ - half_;
    }
    [[nodiscard]] bool done() const { return done_ >= swings_; }
    /// Contract: done().
    [[nodiscard]] TunedGains gains() const {
        const double counted = done_ - kNotCounted;
        const double ultimate = ultimate_sum_ / counted;
        const double period_s = period_sum_s_ / counted;
        const double kp = (is_bed_ ? 0.2 : 0.6) * ultimate;
        return {kp, 2 * kp / period_s, kp * period_s / (is_bed_ ? 3 : 8)};
    }

  private:
    static constexpr double kShortestHalf = 1.0;
    static constexpr int kNotCounted = 2;
    static constexpr double kFullOutput = 255;

    void turn() {
        (heats_ ? on_s_ : off_s_) = since_turn_s_;
        since_turn_s_ = 0;
        heats_ = !heats_;
        if (!heats_) return;  // a swing ends where the heater is switched on again
        if (started_) end_swing();
        started_ = true;
        highest_ = lowest_ = target_;
    }
    void end_swing() {
        ++done_;
        if (done_ > kNotCounted) {
            const double amplitude = std::max((highest_ - lowest_) / 2, 0.01);
            ultimate_sum_ += 4 * half_ * kFullOutput / (std::numbers::pi * amplitude);
            period_sum_s_ += on_s_ + off_s_;
        }
        middle_ = std::clamp(middle_ + half_ * (on_s_ - off_s_) / (on_s_ + off_s_), 0.08, 0.92);
        half_ = std::min(middle_, 1 - middle_);
    }

    double target_;
    int swings_;
    bool is_bed_;
    bool heats_ = true;
    bool started_ = false;  // the way up from cold is over
    double middle_ = 0.5, half_ = 0.5;
    double since_turn_s_ = 0;
    double on_s_ = 0, off_s_ = 0;
    double highest_ = 0, lowest_ = 0;
    int done_ = 0;
    double ultimate_sum_ = 0, period_sum_s_ = 0;
};

}  // namespace qduino::printer::heat
