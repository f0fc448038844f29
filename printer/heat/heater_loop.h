// One heater's part of a sample: watch, decide the duty, and keep account of what it got.
//
//   reading ─► HeaterWatch (rules 1–4) ─┐
//           ─► HeatBalance (rule 5) ────┼─► a fault latches: duty 0
//           ─► ModelControl or Pid ─────┘   else the duty
//                  ▲ give(): what the heater got in truth
//
// Which of the two controls decides is the machine file's `control`. Rule 5 needs the model's
// numbers, so it is on where they are trusted: under model control, and not while they are tuned.
// Loop 3 alone.
#pragma once

#include <optional>

#include "printer/heat/heat_balance.h"
#include "printer/heat/heater_watch.h"
#include "printer/heat/model_control.h"
#include "printer/heat/pid.h"

namespace qduino::printer::heat {

class HeaterLoop {
  public:
    /// Controls the heater that `watch` is for. `manner`: how PID works on it, whatever its gains
    /// are.
    HeaterLoop(const HeaterWatch& watch, const PidGains& manner);

    /// One sample. `target` of 0 °C, or `cut`: off.
    struct Sample {
        Instant now;
        double dt_s = 0;
        std::optional<Celsius> reading;
        Celsius target{};
        bool cut = false;
        bool tuned = false;  ///< its numbers are being found: another decides the duty
        double fan_duty = 0;
        double flow_mm3_s = 0;
        double room_celsius = 20;
    };
    /// Returns the duty that it wants, 0…1.
    [[nodiscard]] double sample(const Sample& sample);
    /// The duty that it gets until the next sample.
    void give(double duty) { given_ = duty; }
    [[nodiscard]] double given() const { return given_; }

    /// Other gains, another model, from now on.
    void set(const HeaterSettings& settings);
    void clear_faults();

    [[nodiscard]] const HeaterWatch& watch() const { return watch_; }
    [[nodiscard]] const HeaterConfig& config() const { return config_; }
    /// The last good reading.
    [[nodiscard]] Celsius shown() const { return shown_; }
    /// There was a reading in the last sample.
    [[nodiscard]] bool reads() const { return reads_; }

  private:
    void check_balance(const Sample& sample, const HeaterDrive& drive);

    HeaterConfig config_;
    PidGains manner_;
    Pid pid_;
    ModelControl model_;
    HeatBalance balance_;
    HeaterWatch watch_;
    Celsius last_target_{};
    Celsius shown_{};
    bool reads_ = false;
    double given_ = 0;
};

}  // namespace qduino::printer::heat
