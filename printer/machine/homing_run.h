// Carries out homing on the motion pipe, and is the one place that knows which axes are homed.
//
// One order (homing.h) at a time. It begins when everything before it has been played. An approach
// ends when loop 2 has seen the switch and loop 1 has had the rest dropped; every order ends with
// its move at the latest.
//
// An axis is homed once it has settled on its switch. It is no longer homed when its motor is
// switched off, when it is homed again, when a homing fails, and when the machine faults. All of
// this is as of what has been played. An interpreter is ahead: it counts on an M84 as soon as it
// has read it. If the job then ends before the M84 is played, tell() puts the interpreter right.
#pragma once

#include <cstdint>

#include "base/result.h"
#include "base/time.h"
#include "printer/gcode/interpreter.h"
#include "printer/machine/homing.h"
#include "printer/machine/motion_pipe.h"
#include "printer/machine/motors.h"
#include "printer/machine/probe_run.h"

namespace qduino::printer::machine {

class HomingRun {
  public:
    /// All must outlive this.
    HomingRun(const MachineConfig& config, MotionPipe& pipe, Motors& motors)
        : config_(config),
          kinematics_(config),
          pipe_(pipe),
          motors_(motors),
          homing_(config),
          probe_(config, pipe, motors) {}

    /// Contract: `axes` is not empty, and holds none but X, Y, Z.
    void begin(gcode::AxisSet axes);
    /// Measures the bed. Contract: as ProbeRun::begin().
    void probe() { probe_.begin(); }
    [[nodiscard]] bool active() const { return homing_.active() || probe_.active(); }

    /// One look, once per release while active. `may_start`: everything before has been played.
    /// True: an axis has just settled at its home position, and the pipe begins anew there. Error:
    /// homing is over, and has failed.
    [[nodiscard]] Result<bool> advance(Instant now, bool may_start);
    /// Loop 2 has dropped everything, and nobody has yet worked out where that left the machine. On
    /// a delta that would make no sense before its carriages have been found: they stand at their
    /// switches.
    void locate();
    /// … and the pipe begins anew where the machine stands.
    [[nodiscard]] Result<void> stopped() {
        if (probe_.active()) return probe_.stopped();
        return running_ ? ended(true) : Result<void>{};
    }
    /// The bed is being measured, or has just been.
    [[nodiscard]] bool probes() const { return !homing_.active(); }
    /// Ends it, wherever it is; no axis is homed then. The caller has the motion stopped.
    void abandon();

    [[nodiscard]] bool homed(Axis axis) const { return homed_[axis]; }
    [[nodiscard]] bool all_homed() const { return homed_[0] && homed_[1] && homed_[2]; }
    /// `axes` may be moved by hand from now on, and so may all that share a motor with them.
    void forget(gcode::AxisSet axes);
    /// Tells `interpreter` which axes are homed.
    void tell(gcode::Interpreter& interpreter) const;

  private:
    /// The order in hand, and loop 2's counts when it began.
    struct Running {
        Instant began{};
        PerAxis<std::uint32_t> hits{};
        StepCounts steps{};
    };

    void start(Instant now);
    void append(const Homing::Order& order);
    [[nodiscard]] bool watch(const Homing::Order& order, bool on);
    [[nodiscard]] bool all_pressed(const Homing::Order& order) const;
    [[nodiscard]] Result<void> ended(bool pressed);
    motion::AxisVector stand_at_home(gcode::AxisSet axes);
    void settle(gcode::AxisSet axes);
    [[nodiscard]] Error failed(Axis axis, std::string_view why);

    const MachineConfig& config_;
    Kinematics kinematics_;
    MotionPipe& pipe_;
    Motors& motors_;
    Homing homing_;
    ProbeRun probe_;
    std::optional<Running> running_;
    PerAxis<bool> homed_{};
};

}  // namespace qduino::printer::machine
