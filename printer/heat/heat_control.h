// Loop 3's work: two heaters and the part fan, one sample at a time.
//
//   targets (four-slot, loop 1 writes) ──────►┐
//   readings (converter, read by the sketch) ─►  watch → PID ─► duties (the sketch drives the pins)
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
#include "printer/heat/heater_watch.h"
#include "printer/heat/idle_watch.h"
#include "printer/heat/pid.h"
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
};

struct HeatReadings {
    std::optional<Celsius> hot_end;
    std::optional<Celsius> bed;
    std::uint64_t step_pulses = 0;  ///< ever sent by loop 2: while they go out, the heat is used
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

    /// Loop 3, once per sample. `cut` is the emergency stop: heat off whatever is asked.
    [[nodiscard]] HeatDuties sample(Instant now, const HeatReadings& readings, bool cut);

  private:
    struct Heater {
        Pid pid;
        HeaterWatch watch;
        Celsius last_target{};
        Celsius shown{};       // last good reading
        bool reading = false;  // there is one now
    };
    double drive(Heater& heater, Instant now, std::optional<Celsius> reading, Celsius target, double dt_s,
                 bool cut);
    [[nodiscard]] bool nobody_uses(Instant now, const HeatTargets& targets, std::uint64_t step_pulses);
    void publish(const HeatTargets& targets, const HeatDuties& duties);
    [[nodiscard]] static link::HeaterStatus status_of(const Heater& heater, Celsius target, double duty);

    Heater hot_end_;
    Heater bed_;
    bool has_bed_;
    double idle_timeout_s_;
    IdleWatch idle_;
    channel::FourSlot<HeatTargets> targets_;
    channel::FourSlot<link::HeatStatus> for_loop_1_;
    channel::Broadcast<link::HeatStatus, 2> status_;
    std::uint64_t samples_ = 0;
    std::uint32_t cleared_ = 0;
    Instant last_{};
};

}  // namespace qduino::printer::heat
