// What one pin did in a whole run, in a sentence.
//
//   told    low ▁▁▁▔▔▔▁▁▁▔▔▔▁▁▁      said    10 pulses, period 1000.000 ms ± 0, each 500.000 ms
//               └─period─┘
//
// A pulse is a stretch of high that has ended. A period is from the beginning of one pulse to that
// of the next. Constant memory: only sums and bounds are kept.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/time.h"

namespace qduino::apps {

/// Shortest and longest of some stretches, and their mean.
class Spread {
  public:
    void add(Nanoseconds length);
    [[nodiscard]] std::int64_t count() const { return count_; }
    [[nodiscard]] Nanoseconds shortest() const { return shortest_; }
    [[nodiscard]] Nanoseconds longest() const { return longest_; }
    /// Zero when there are none.
    [[nodiscard]] Nanoseconds mean() const;
    /// "500.000 ms ± 0"; where they differ by more than 5 % of their mean: "2.1 ms … 80 ms".
    [[nodiscard]] std::string words(bool with_deviation) const;

  private:
    std::int64_t count_ = 0;
    double sum_ns_ = 0;
    Nanoseconds shortest_{}, longest_{};
};

/// Told in order of time.
class PinStory {
  public:
    void level(Instant now, bool high);
    /// The duty of a PWM output: 0 to 1. The ends are levels.
    void duty(Instant now, double duty);
    /// The period of its PWM; 0: the board's own.
    void pwm_period(Nanoseconds period) { pwm_period_ = period; }
    /// The board drives it no more.
    void released(Instant now);

    /// It was driven at all.
    [[nodiscard]] bool told() const { return told_; }
    /// Pulses that have ended.
    [[nodiscard]] std::int64_t pulses() const { return pulses_; }
    [[nodiscard]] const Spread& periods() const { return periods_; }
    [[nodiscard]] Instant last_change() const { return last_change_; }
    /// "10 pulses, period …": without the pin's name and a full stop. Instants count from `origin`.
    [[nodiscard]] std::string sentence(Instant origin) const;

  private:
    void end_pulse(Instant now);
    [[nodiscard]] std::string pulses_said(Instant origin) const;
    [[nodiscard]] std::string tone_said() const;
    [[nodiscard]] std::string pwm_said() const;

    bool told_ = false;
    std::optional<bool> high_;  // none: PWM, or not driven
    Instant since_{};           // of high_
    Instant last_change_{};
    std::optional<Instant> last_rise_;
    std::int64_t pulses_ = 0;
    Nanoseconds last_width_{};
    Spread periods_;
    Spread widths_;  // without that of the last pulse, which the end of the run may have cut
    Spread tones_;   // periods of pulses as long as the pauses, within what can be heard
    bool pwm_ = false;
    double duty_ = -1, least_duty_ = 1, most_duty_ = 0;
    std::int64_t duty_changes_ = 0;
    Nanoseconds pwm_period_{};
};

}  // namespace qduino::apps
