// M109, M190 and TEMPERATURE_WAIT: the job is held until a heater has been near its target, or
// between two temperatures, for long enough.
//
//   celsius      ____________   within at_target_celsius …
//             _/ |<-- s -->|    … for at_target_s without a break: the wait is over
//
// Pure: the readings and the time are passed in.
#pragma once

#include <optional>

#include "base/quantity.h"
#include "base/time.h"
#include "printer/gcode/actions.h"
#include "printer/machine_config.h"

namespace qduino::printer::machine {

class HeatWait {
  public:
    void begin(gcode::Heater heater, Celsius target, gcode::WaitFor direction) {
        asked_ = Asked{heater, target, direction};
        at_target_since_.reset();
    }
    void clear() { asked_.reset(); }
    [[nodiscard]] bool active() const { return asked_.has_value(); }
    /// Contract: active.
    [[nodiscard]] gcode::Heater heater() const {
        QDUINO_EXPECT(active());
        return asked_->heater;
    }

    /// One look at the heater waited for, whose numbers are `config`. Contract: active. True, once:
    /// the wait is over.
    bool is_over(Instant now, Celsius reading, const HeaterConfig& config) {
        QDUINO_EXPECT(active());
        const double celsius = reading.value(), target = asked_->target.value();
        const double content = content_from(config, asked_->target).value();
        const bool up_only = asked_->direction == gcode::WaitFor::heating;
        const bool between = asked_->direction.kind == gcode::WaitFor::between;
        const double low = between ? asked_->direction.lowest.value() : content;
        const double high = between ? asked_->direction.highest.value() : target + config.at_target_celsius;
        const bool warm_enough = celsius >= low;
        const bool cool_enough = up_only || celsius <= high;
        if (!warm_enough || !cool_enough) at_target_since_.reset();
        if (warm_enough && cool_enough && !at_target_since_) at_target_since_ = now;
        const bool off = target <= 0 && up_only;
        const bool over =
            off || (at_target_since_ && to_seconds(now - *at_target_since_) >= config.at_target_time.value());
        if (over) clear();
        return over;
    }

  private:
    struct Asked {
        gcode::Heater heater;
        Celsius target;
        gcode::WaitFor direction;
    };

    std::optional<Asked> asked_;
    std::optional<Instant> at_target_since_;
};

}  // namespace qduino::printer::machine
