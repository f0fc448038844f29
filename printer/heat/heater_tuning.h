// One experiment on one heater, as loop 1 asks for it and loop 3 makes it.
//
//   loop 1   TuningRequest {number, kind, heater, target} ─four-slot─► loop 3  HeaterTuning
//            TuningReport  {number, state, what was found} ◄─four-slot─┘
//
// The experiment is over when it has its result, when it fails, or when the heater's target is no
// longer the experiment's: whatever switches a heater off (a cancelled job, a fault, the emergency
// stop) thus ends it. The rules of heater_watch.h watch it as any heating; rule 5 needs the numbers
// that are being found, and rests.
#pragma once

#include <variant>

#include "base/fixed_string.h"
#include "base/quantity.h"
#include "printer/heat/model_tuning.h"
#include "printer/heat/pid_tuning.h"
#include "printer/machine_config.h"

namespace qduino::printer::heat {

struct TuningRequest {
    std::uint32_t number = 0;  ///< a new one begins an experiment; 0: none was ever asked for
    HeaterControl kind = HeaterControl::pid;
    bool of_bed = false;
    Celsius target{};
    int swings = 5;  ///< of a PID's
};

enum class TuningState : std::uint8_t { none, runs, done, failed };

struct TuningReport {
    std::uint32_t number = 0;
    TuningState state = TuningState::none;
    HeaterSettings found{};  ///< the heater's, with what was found in its place
    FixedString<96> why{};   ///< failed
};

class HeaterTuning {
  public:
    /// Ends an experiment that never does by itself.
    static constexpr double kLongestS = 3 * 3600;

    /// Begins what `request` asks for, on a heater whose numbers are `config`.
    void begin(const TuningRequest& request, const HeaterConfig& config) {
        report_ = {request.number, TuningState::runs, settings_of(config), {}};
        request_ = request;
        elapsed_s_ = 0;
        if (request.kind == HeaterControl::pid) {
            experiment_.emplace<PidTuning>(request.target.value(), request.swings, request.of_bed);
        } else {
            experiment_.emplace<ModelTuning>(config.model, request.target.value(), !request.of_bed);
        }
    }
    [[nodiscard]] bool runs() const { return report_.state == TuningState::runs; }
    [[nodiscard]] bool runs_on_bed() const { return runs() && request_.of_bed; }
    [[nodiscard]] bool runs_on_hot_end() const { return runs() && !request_.of_bed; }
    [[nodiscard]] Celsius target() const { return request_.target; }
    [[nodiscard]] const TuningReport& report() const { return report_; }

    void stop(std::string_view why) {
        if (!runs()) return;
        report_.state = TuningState::failed;
        report_.why.assign(why);
    }

    /// One sample of the heater in question. Contract: runs().
    [[nodiscard]] ModelTuning::Output sample(Celsius reading, double given_duty, double dt_s) {
        elapsed_s_ += dt_s;
        if (elapsed_s_ > kLongestS) stop("it takes too long");
        if (auto* pid = std::get_if<PidTuning>(&experiment_)) {
            const double duty = pid->sample(reading.value(), dt_s);
            if (pid->done()) take(pid->gains());
            return {duty, {}, true};
        }
        auto& model = std::get<ModelTuning>(experiment_);
        const ModelTuning::Output output = model.sample(reading.value(), given_duty, dt_s);
        if (!model.failure().empty()) {
            stop(model.failure());
        } else if (model.done()) {
            report_.found.model = model.model();
            report_.state = TuningState::done;
        }
        return output;
    }

  private:
    void take(const TunedGains& gains) {
        report_.found.kp = gains.kp;
        report_.found.ki = gains.ki;
        report_.found.kd = gains.kd;
        report_.state = TuningState::done;
    }

    TuningRequest request_;
    TuningReport report_;
    double elapsed_s_ = 0;
    std::variant<PidTuning, ModelTuning> experiment_{PidTuning{0, PidTuning::kFewestSwings, false}};
};

}  // namespace qduino::printer::heat
