// How long the heaters will take: loop 3's own control on a model of what it heats.
//
//   targets ─► HeatControl ─► duties ─► after(model, …) ─► converter ─► readings ─┐
//                  ▲                    (heater_model.h)                          │
//                  └──────────────────────────────────────────────────────────────┘ 8 ms later
//
// A formula for heating at full power misses the end of a heat-up, where the control takes the
// power back: that is a fifth of the time. So the control itself runs here, on the model, sample
// by sample (heat/heat_control.h), and a wait ends as the machine's does (machine/heat_wait.h).
// It sees what the converter makes of a temperature: near a target a step of it is half a second.
//
// A print lasts hours and its waits minutes. So only what follows a change of a target is played
// through: after kSettled of the same targets, a heater stands at its target, or cools by the
// model alone.
//
// It knows nothing of the part fan and of the plastic's heat: they hardly matter in a wait.
// Pure. About 3 KB; the constructor's machine must outlive it.
#pragma once

#include <array>
#include <optional>

#include "device/temperature_sensor.h"
#include "printer/heat/heat_control.h"
#include "printer/machine/heat_wait.h"

namespace qduino::printer::estimate {

class HeatForecast {
  public:
    /// Cold heaters, switched off.
    explicit HeatForecast(const MachineConfig& machine);

    /// From now on. 0 °C: off.
    void set_target(gcode::Heater heater, Celsius target);
    /// `duration_s` of motion go by.
    void pass(double duration_s);
    /// Seconds, in whole releases of loop 1, until a wait for `heater` is over that begins now;
    /// that time goes by. kNever when the heater does not get there.
    /// 0 once too much has been played.
    [[nodiscard]] double wait(gcode::Heater heater, Celsius target, gcode::WaitFor direction);

    /// What the sensor would read now.
    [[nodiscard]] Celsius reading(gcode::Heater heater) const;

    /// A wait is given up after so long.
    static constexpr double kNever = 3600;
    /// So much is played through in all, 6 s of work or so. A job that asks for more (a bed heated
    /// and cooled a thousand times) is not printed: what follows takes no time.
    static constexpr double kPlayed_s = 86400;
    /// Loop 3's period, and loop 1's.
    static constexpr double kSample_s = 0.008;
    static constexpr double kRelease_s = 0.1;

  private:
    static constexpr double kSettled_s = 300;

    struct Block {
        Block(const HeaterConfig& heater, double room_celsius)
            : config(&heater), sensor(heater.sensor), state{room_celsius, room_celsius} {}

        const HeaterConfig* config;
        device::TemperatureSensor sensor;
        HeaterState state;
        double target_celsius = 0;

        /// What loop 3 reads; nothing where the converter's end is reached.
        [[nodiscard]] std::optional<Celsius> shown() const;

        void advance(double duty, double room_celsius, double seconds) {
            state = after(config->model, state, {.duty = duty, .room_celsius = room_celsius}, seconds);
        }
        /// Long after the last change of a target.
        void settle(double duration_s, double room_celsius);
    };

    Block& block(gcode::Heater heater) { return blocks_[heater == gcode::Heater::bed ? 1 : 0]; }
    [[nodiscard]] const Block& block(gcode::Heater heater) const {
        return blocks_[heater == gcode::Heater::bed ? 1 : 0];
    }
    void sample();
    void play(double duration_s);

    double room_celsius_;
    bool has_bed_;
    channel::FourSlot<link::HeatStatus> unread_;
    heat::HeatControl control_;
    heat::HeatTargets targets_;
    std::array<Block, 2> blocks_;
    machine::HeatWait wait_;
    Instant now_{};      ///< of the samples: settled time is not played through
    double owed_s_ = 0;  ///< time that is less than a sample
    double same_targets_s_ = 0;
    double played_s_ = 0;
    std::uint64_t pulses_ = 0;  ///< motion uses the heat
};

}  // namespace qduino::printer::estimate
