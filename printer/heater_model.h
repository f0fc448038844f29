// A heater as control, its watch and the estimate of a job's time reckon with it: a block that
// loses heat, and a sensor that lags behind the block.
//
//   power ──► [ block T ] ──lag──► [ sensor S ] ──► reading
//                │  │  └ filament takes heat       C dT/dt = P·duty − G·(T − T_room) + extra
//                │  └ part fan takes heat          τ dS/dt = T − S
//                └ the room takes heat             G = loss + fan·duty_fan + filament·flow
//
// While duty, fan and flow are constant, both equations have a closed form, so one call may step 8
// ms or an hour. Two bodies are the least that explain an overshoot: when the sensor reads the
// target, the block is hotter by lag · rate already.
//
// Source of the form: two thermal masses in series, as Marlin's documentation of its model
// predictive control (M306) names them: heater power, block heat capacity, sensor responsiveness
// (1/lag), ambient transfer without and with fan, filament heat capacity. Pure; any loop may call
// it.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace qduino::printer {

/// The numbers of one heater. Defaults: the reference machine's hot end, as M306 T finds them.
struct HeaterModel {
    double power_w = 40;             ///< at full duty
    double heat_capacity_j_k = 22;   ///< of the block
    double loss_w_k = 0.09;          ///< to the room, part fan off
    double fan_loss_w_k = 0.0225;    ///< on top of that, part fan at full duty
    double sensor_lag_s = 2.47;      ///< time constant
    double filament_j_mm3_k = 2e-3;  ///< heat that a mm³ of filament takes, for each kelvin

    friend constexpr bool operator==(const HeaterModel&, const HeaterModel&) = default;
};

struct HeaterState {
    double block_celsius = 0;
    double sensor_celsius = 0;
};

/// What acts on the heater.
struct HeaterDrive {
    double duty = 0;        ///< 0…1
    double fan_duty = 0;    ///< 0…1, of the part fan
    double flow_mm3_s = 0;  ///< filament that is melted
    double room_celsius = 20;
    double extra_w = 0;  ///< heat that comes from elsewhere
};

/// W/K from the block to the room, the fan's air and the filament.
inline double conductance_w_k(const HeaterModel& model, const HeaterDrive& drive) {
    return model.loss_w_k + model.fan_loss_w_k * drive.fan_duty + model.filament_j_mm3_k * drive.flow_mm3_s;
}

/// The heater `seconds` (not negative) later, if `drive` stays. Contract: capacity, loss and lag of
/// `model` are above 0.
inline HeaterState after(const HeaterModel& model, const HeaterState& now, const HeaterDrive& drive,
                         double seconds) {
    const double loss_w_k = conductance_w_k(model, drive);
    const double settled = drive.room_celsius + (model.power_w * drive.duty + drive.extra_w) / loss_w_k;
    const double block_s = model.heat_capacity_j_k / loss_w_k;
    const bool alike = std::abs(block_s - model.sensor_lag_s) < 1e-6 * block_s;
    // Equal time constants would divide by 0; a hair apart they are the same physics.
    const double lag_s = alike ? block_s * (1 - 1e-5) : model.sensor_lag_s;
    const double gap = now.block_celsius - settled;
    const double share = block_s / (block_s - lag_s);
    const double block_decay = std::exp(-seconds / block_s);
    const double sensor_decay = std::exp(-seconds / lag_s);
    return {settled + gap * block_decay, settled + share * gap * block_decay +
                                             (now.sensor_celsius - settled - share * gap) * sensor_decay};
}

/// The power that keeps the block at `celsius`; it may be more than the heater has, or negative.
inline double holding_w(const HeaterModel& model, double celsius, const HeaterDrive& drive) {
    return conductance_w_k(model, drive) * (celsius - drive.room_celsius) - drive.extra_w;
}

/// Control brings the block to its target in an exponential of this time constant. A shorter one
/// than the lag would act on what the sensor has not shown yet.
inline double approach_s(const HeaterModel& model) { return std::max(1.2 * model.sensor_lag_s, 2.0); }

/// The duty (0…1) that takes the block to `target_celsius`: full power until near, then the
/// approach. `drive.duty` is not looked at.
inline double duty_towards(const HeaterModel& model, double block_celsius, double target_celsius,
                           const HeaterDrive& drive) {
    const double approach_w = model.heat_capacity_j_k * (target_celsius - block_celsius) / approach_s(model);
    return std::clamp((approach_w + holding_w(model, block_celsius, drive)) / model.power_w, 0.0, 1.0);
}

/// How long full power takes until the sensor reads `to_celsius`, from rest at `from_celsius`.
/// Infinite: it never does. `drive.duty` is not looked at.
inline double full_power_time_s(const HeaterModel& model, double from_celsius, double to_celsius,
                                HeaterDrive drive = {}) {
    drive.duty = 1;
    if (from_celsius >= to_celsius) return 0;
    if (holding_w(model, to_celsius, drive) >= model.power_w) return std::numeric_limits<double>::infinity();
    const auto reached = [&](double seconds) {
        return after(model, {from_celsius, from_celsius}, drive, seconds).sensor_celsius >= to_celsius;
    };
    double high = 1;
    while (!reached(high)) high *= 2;
    double low = 0;
    while (high - low > 1e-3) (reached((low + high) / 2) ? high : low) = (low + high) / 2;
    return high;
}

/// How long M109 or M190 waits, from rest at `from_celsius`: until the reading has been within
/// `within_celsius` of the target for `stay_s`. Infinite: it never is. In steps of 50 ms of the
/// controlled heater: some thousand steps for a bed.
inline double waiting_time_s(const HeaterModel& model, double from_celsius, double to_celsius,
                             double within_celsius, double stay_s, HeaterDrive drive = {}) {
    const double fastest = full_power_time_s(model, from_celsius, to_celsius, drive);
    if (!std::isfinite(fastest)) return fastest;
    constexpr double kStep = 0.05;
    HeaterState state{from_celsius, from_celsius};
    const double latest = 2 * fastest + 60 * approach_s(model);
    for (double seconds = 0; seconds < latest; seconds += kStep) {
        if (state.sensor_celsius >= to_celsius - within_celsius) return seconds + stay_s;
        drive.duty = duty_towards(model, state.block_celsius, to_celsius, drive);
        state = after(model, state, drive, kStep);
    }
    return std::numeric_limits<double>::infinity();
}

}  // namespace qduino::printer
