// Heat as loop 1 sees it: the targets it asks for, the answers of loop 3, and the targets that a
// paused job goes on with.
//
//   set_target() ─► targets ──four-slot──► loop 3  sample()
//                      ▲                                │
//   settings, tuning ──┘
//   kept while the job │ is paused, or has lost         └──four-slot──► observe() ─► seen(),
//   its heat: asked for again by resume                                 fault(), idle_lost()
#pragma once

#include <optional>
#include <string_view>

#include "printer/gcode/actions.h"
#include "printer/heat/heat_control.h"
#include "printer/machine/heat_wait.h"

namespace qduino::printer::machine {

class Heating {
  public:
    /// When loop 3 has not sampled for so long, loop 1 must see to it that the heaters go off.
    static constexpr Nanoseconds kSilence = 500ms;

    /// Both must outlive this. Loop 3's status also goes to `published`.
    Heating(const MachineConfig& config, channel::FourSlot<link::HeatStatus>& published);

    // ---- loop 3 ---------------------------------------------------------------------------------

    /// `cut`: an emergency stop; heat off whatever is asked.
    [[nodiscard]] heat::HeatDuties sample(Instant now, const heat::HeatReadings& readings, bool cut) {
        return control_.sample(now, readings, cut);
    }

    // ---- loop 1: what is heard ------------------------------------------------------------------

    /// Takes loop 3's freshest word. Once per release, before anything is decided.
    void observe(Instant now);
    [[nodiscard]] const link::HeatStatus& seen() const { return seen_; }
    [[nodiscard]] bool silent() const { return silent_; }
    /// Why the machine must stop; empty: it need not.
    [[nodiscard]] std::string_view fault() const;
    /// The fault that would come again at once if it were cleared now; empty: none.
    [[nodiscard]] std::string_view persisting_fault() const;
    /// Loop 3 has cut heaters that are asked for and that nobody used.
    [[nodiscard]] bool idle_lost() const;
    /// An error in words while the hot end is too cold to move `filament_mm`.
    [[nodiscard]] Result<void> check_cold(double filament_mm) const;
    /// M302: the least temperature at which filament moves.
    void set_minimum_extrude(Celsius limit) { minimum_extrude_ = limit; }

    // ---- loop 1: what is asked ------------------------------------------------------------------

    /// Whether `target` would take from a job what it counts on: a heater that is on goes off, or
    /// the hot end goes below what filament takes.
    [[nodiscard]] bool takes_heat(gcode::Heater heater, Celsius target) const;
    /// Somebody asks for a temperature. Kept targets change with it.
    void set_target(gcode::Heater heater, Celsius target);
    void set_fan(double duty) {
        targets_.fan_duty = duty;
        control_.set_targets(targets_);
    }
    void heaters_off() {
        targets_.hot_end = targets_.bed = Celsius{};
        control_.set_targets(targets_);
    }
    void all_off() {
        targets_.fan_duty = 0;
        heaters_off();
    }
    /// Loop 3 forgets its latched faults.
    void clear_faults();

    // ---- loop 1: the heaters' numbers -----------------------------------------------------------

    /// Takes effect with loop 3's next sample.
    void change(gcode::Heater heater, const gcode::HeaterChange& change);
    [[nodiscard]] const HeaterSettings& settings(gcode::Heater heater) const {
        return heater == gcode::Heater::bed ? targets_.bed_settings : targets_.hot_end_settings;
    }
    /// The settings in force, as those that are kept from now on.
    [[nodiscard]] link::KeptHeat keep_settings();
    /// As of the last keep_settings(), whose number it has, or of the start.
    [[nodiscard]] const link::KeptHeat& kept_settings() const { return kept_settings_; }
    /// Restores those that the last keep_settings() kept, or else those of the start.
    void restore_settings() { take_settings(kept_settings_.hot_end, kept_settings_.bed); }
    /// Restores the machine file's. What is kept stays kept.
    void take_factory_settings() {
        take_settings(factory_settings_of(config_.hot_end), factory_settings_of(config_.bed));
    }

    /// What a job may change of the heaters' numbers.
    struct Adjusted {
        HeaterSettings hot_end, bed;
    };
    [[nodiscard]] Adjusted adjusted() const { return {targets_.hot_end_settings, targets_.bed_settings}; }
    /// Back to `numbers`, and M302's limit to the machine file's.
    void restore(const Adjusted& numbers);

    /// An experiment that has ended.
    struct TuningOver {
        gcode::TuningAsked asked;
        heat::TuningReport report;
    };
    /// Asks for an experiment; it begins with advance_tuning().
    void tune(const gcode::TuningAsked& asked) { tuning_ = Tuning{asked}; }
    /// Begins what was asked for. An experiment that has ended is told once: its heater is off, and
    /// what it found is in force if that was asked for.
    [[nodiscard]] std::optional<TuningOver> advance_tuning();

    // ---- loop 1: while a job is paused ----------------------------------------------------------

    /// Keeps the targets in force, unless some are kept already; later requests change them.
    void keep_targets();
    [[nodiscard]] bool keeps_targets() const { return kept_.has_value(); }
    /// Filament may be moved now, and once the kept targets are reached again. Contract: targets
    /// are kept.
    [[nodiscard]] bool may_extrude_now_and_later() const;
    /// Contract: targets are kept.
    void ask_for_kept();
    void forget_kept() { kept_.reset(); }
    [[nodiscard]] bool is_warm_again() const;
    /// The heater that is furthest below its target.
    [[nodiscard]] gcode::Heater coldest() const;

    // ---- loop 1: while a job waits for heat -----------------------------------------------------

    [[nodiscard]] HeatWait& wait() { return wait_; }
    [[nodiscard]] const HeatWait& wait() const { return wait_; }
    void advance_wait(Instant now);
    /// The job is held: it waits for heat, or an experiment is on.
    [[nodiscard]] bool holds() const { return wait_.active() || tuning_.has_value(); }
    /// Gives up what holds(). The targets stay.
    void forget_wait() {
        wait_.clear();
        tuning_.reset();
    }

  private:
    struct Tuning {
        gcode::TuningAsked asked;
        bool begun = false;
    };
    struct Kept {
        Celsius hot_end;
        Celsius bed;
    };

    void note_request(gcode::Heater heater, Celsius target);
    void take_settings(const HeaterSettings& hot_end, const HeaterSettings& bed);

    const MachineConfig& config_;
    heat::HeatControl control_;
    heat::HeatTargets targets_;
    link::HeatStatus seen_;
    std::optional<Instant> alive_;  // when loop 3 last showed a new sample
    bool silent_ = false;
    std::optional<Kept> kept_;  // in force when the job was paused, or lost its heat
    HeatWait wait_;
    std::optional<Tuning> tuning_;
    link::KeptHeat kept_settings_;
    Celsius minimum_extrude_;
};

}  // namespace qduino::printer::machine
