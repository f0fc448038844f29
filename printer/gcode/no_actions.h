// A machine that takes everything and does nothing: for judging G-code without one.
#pragma once

#include "printer/gcode/actions.h"

namespace qduino::printer::gcode {

class NoActions : public Actions {
  public:
    Result<void> move(const Move&) override { return {}; }
    Result<void> dwell(Seconds) override { return {}; }
    Result<void> home(AxisSet) override { return {}; }
    Result<void> probe_bed() override { return {}; }
    Result<void> change_bed(const BedChange&) override { return {}; }
    Result<void> set_temperature(Heater, Celsius) override { return {}; }
    Result<void> wait_temperature(Heater, Celsius, WaitFor) override { return {}; }
    Result<void> set_heater(Heater, const HeaterChange&) override { return {}; }
    Result<void> tune_heater(const TuningAsked&) override { return {}; }
    Result<void> settings(SettingsAsked) override { return {}; }
    Result<void> set_fan(std::uint8_t, double) override { return {}; }
    Result<void> motors_off(AxisSet) override { return {}; }
    Result<void> motors_time_out(Seconds) override { return {}; }
    Result<void> set_limits(const LimitChange&) override { return {}; }
    Result<void> set_compensation(const CompensationChange&) override { return {}; }
    void factors(double, double) override {}
    void message(std::string_view) override {}
    void progress(const Progress&) override {}
    void report(Report) override {}
    Result<void> pause(const PauseOrder&) override { return {}; }
    void emergency_stop() override {}
    void note(NoteKind, std::string_view, const Source&) override {}
};

}  // namespace qduino::printer::gcode
