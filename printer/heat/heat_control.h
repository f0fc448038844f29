// Loop 3's work: two heaters and the part fan, one sample at a time.
//
//   targets (four-slot, loop 1 writes) ──────►┐
//   readings (converter, read by the sketch) ─►  watch → control ─► duties (the sketch's pins)
//                                                ▲           └► status (four-slots)
//                                             idle watch ◄─ step pulses, temperatures asked for
//
// It depends on nothing but loop 3. With loops 1 and 2 dead, or the service gone, it goes on
// watching. When the sketch itself is gone, the supervisor forces the safe states of the heaters
// (apps/supervisor).
#pragma once

#include <optional>

#include "base/quantity.h"
#include "base/time.h"
#include "channel/broadcast.h"
#include "channel/four_slot.h"
#include "printer/heat/filament_flow.h"
#include "printer/heat/heater_loop.h"
#include "printer/heat/heater_tuning.h"
#include "printer/heat/idle_watch.h"
#include "printer/link/layout.h"
#include "printer/machine_config.h"

namespace qduino::printer::heat {

/// What loop 1 asks for. The counters tell a repeated request from an old one.
struct HeatTargets {
    Celsius hot_end{};  ///< 0: off
    Celsius bed{};
    double fan_duty = 0;
    std::uint32_t clear_faults = 0;  ///< a new number clears latched faults
    /// A new number: a temperature was asked for, maybe the same again.
    std::uint32_t requests = 0;
    TuningRequest tuning{};  ///< its target must be the heater's, too
    /// Other settings: in force once `settings_number` is new.
    std::uint32_t settings_number = 0;
    HeaterSettings hot_end_settings{};
    HeaterSettings bed_settings{};
};

struct HeatReadings {
    std::optional<Celsius> hot_end;
    std::optional<Celsius> bed;
    std::uint64_t step_pulses = 0;    ///< ever sent by loop 2: while they go out, the heat is used
    std::int64_t filament_steps = 0;  ///< where E stands
};

/// The duties that the sketch drives onto the pins; 0…1.
struct HeatDuties {
    double hot_end = 0;
    double bed = 0;
    double fan = 0;
};

class HeatControl {
  public:
    /// `service` is the link's, and outlives the control.
    HeatControl(const MachineConfig& config, channel::FourSlot<link::HeatStatus>& service);

    /// Loop 1. Wait-free.
    void set_targets(const HeatTargets& targets) { targets_.write(targets); }
    /// Loop 1. Wait-free; the freshest sample's result.
    [[nodiscard]] link::HeatStatus status() const { return for_loop_1_.read(); }
    /// Loop 1. Wait-free; the newest experiment.
    [[nodiscard]] TuningReport tuning() const { return tuning_report_.read(); }

    /// Loop 3, once per sample. `cut` is the emergency stop: heat off whatever is asked.
    [[nodiscard]] HeatDuties sample(Instant now, const HeatReadings& readings, bool cut);

  private:
    /// What both heaters see in a sample.
    struct Surroundings {
        Instant now;
        double dt_s = 0;
        double flow_mm3_s = 0;
        bool cut = false;
    };

    /// The samples so far, and the newest of loop 1's numbers that they have heeded.
    struct Taken {
        std::uint64_t samples = 0;
        Instant last{};
        std::uint32_t cleared = 0;
        std::uint32_t settings = 0;
    };

    void take(const HeatTargets& targets);
    double drive(HeaterLoop& heater, std::optional<Celsius> reading, Celsius target, const Surroundings& at);
    void follow_tuning(const HeatTargets& targets, bool cut);
    void note_room(const HeatReadings& readings);
    [[nodiscard]] bool nobody_uses(Instant now, const HeatTargets& targets, std::uint64_t step_pulses);
    void publish(const HeatTargets& targets, const HeatDuties& duties);
    [[nodiscard]] static link::HeaterStatus status_of(const HeaterLoop& heater, Celsius target, double duty);
    [[nodiscard]] bool faulted() const { return hot_end_.watch().faulted() || bed_.watch().faulted(); }

    HeaterLoop hot_end_;
    HeaterLoop bed_;
    bool has_bed_;
    double idle_timeout_s_;
    IdleWatch idle_;
    FilamentFlow flow_;
    HeaterTuning tuning_;
    std::optional<double> tuned_fan_;  // what an experiment makes of the fan
    double fan_duty_ = 0;
    double room_celsius_ = 40;
    channel::FourSlot<HeatTargets> targets_;
    channel::FourSlot<link::HeatStatus> for_loop_1_;
    channel::FourSlot<TuningReport> tuning_report_;
    channel::Broadcast<link::HeatStatus, 2> status_;
    Taken taken_;
};

}  // namespace qduino::printer::heat
