// What every job begins from, and what becomes of a job's own settings.
//
//   M203, M204, M900, M593, M301, M852 …   of a job, or a serial host   in force until it is over
//                                          of a person, between jobs    in force from then on
//   M500                                   of anyone                    the heaters' numbers
//
// A job must make the same steps whatever was printed before it. The modes of G-code begin anew
// with each job by themselves (gcode/interpreter.h). What else a command changes stands in the
// parts: limits of motion, accelerations, pressure advance, shapers, skew, the fade of the bed,
// which bed is in force, the heaters' numbers, the motors' time-out. All of it is noted here, and
// put back when a job or a host is over. The limit of M302 always goes back to the machine file's:
// preflight judges by that.
//
// What was found out about the machine stays: where the head stands, which axes are homed, and the
// bed that was measured last. Profiles of beds stay as well, since they have names.
//
// Loop 1 only.
#pragma once

#include <cstdint>
#include <utility>

#include "printer/machine/heating.h"
#include "printer/machine/motion_pipe.h"
#include "printer/machine/motors.h"

namespace qduino::printer::machine {

class BaseSettings {
  public:
    /// All must outlive this.
    BaseSettings(MotionPipe& pipe, Heating& heating, Motors& motors)
        : pipe_(pipe),
          heating_(heating),
          motors_(motors),
          motion_(pipe.adjusted()),
          heat_(heating.adjusted()),
          motors_off_after_(motors.time_out()) {}

    /// Jobs begin from what is in force now: a person has asked for it.
    void take() {
        motion_ = pipe_.adjusted();
        heat_ = heating_.adjusted();
        kept_ = heating_.kept_settings().number;
        motors_off_after_ = motors_.time_out();
    }
    /// … of the bed alone: it has been measured.
    void take_bed() { motion_.mesh = pipe_.correction().mesh(); }
    /// A job or a host is over, or begins: nothing of another one is in force.
    void restore() {
        const link::KeptHeat& kept = heating_.kept_settings();
        if (std::exchange(kept_, kept.number) != kept.number) heat_ = {kept.hot_end, kept.bed};
        pipe_.restore(motion_);
        heating_.restore(heat_);
        motors_.time_out_after(motors_off_after_);
    }

  private:
    MotionPipe& pipe_;
    Heating& heating_;
    Motors& motors_;
    MotionPipe::Adjusted motion_;
    Heating::Adjusted heat_;
    std::uint32_t kept_ = 0;  // M500, so often
    Nanoseconds motors_off_after_;
};

}  // namespace qduino::printer::machine
