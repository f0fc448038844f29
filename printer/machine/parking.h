// Away from the path: where the head goes while a job is paused, and how it comes back.
//
//        stop ──retract──┐ hop                    lower ┌──un-retract── stop, to the step
//   path ═══●            │      park place              │            ●═══ path
//                        └────────► ● jogs … ● ─────────┘
//   state   pausing ......................│paused│ printing ............ printing
//   Phase   on_path │ leaving             │parked│ heating │ returning │ on_path
//
// The way out and back is planned and played like any other motion, by a planner of its own
// (MotionPipe::depart). X, Y and Z come back to the numbers at which the path was left, so to the
// same steps; loop 2's counts prove it. E counts on from where it left, whatever filament was
// pushed or drawn meanwhile.
//
// M600 changes the filament: at the park place the old one is drawn out as far as `unload`, and
// before the way back as much is pushed in again, and `purge` on top. All of it is beside the part.
//
// Lines typed while the head waits go through an interpreter of their own. The job's interpreter
// stands still, with all its modes, where the path was read to.
//
// The head rests at both ends of the way. So an observer of the pulses alone can tell the way from
// the path (twin/excursions.h). Loop 1 only.
#pragma once

#include <utility>

#include "base/result.h"
#include "printer/gcode/interpreter.h"
#include "printer/machine/heating.h"
#include "printer/machine/homing_run.h"
#include "printer/machine/motion_pipe.h"
#include "printer/machine/motors.h"
#include "printer/machine/printed_top.h"

namespace qduino::printer::machine {

class Parking {
  public:
    /// All must outlive this. `actions` carries out the lines typed meanwhile.
    Parking(const MachineConfig& config, MotionPipe& pipe, Heating& heating, Motors& motors,
            gcode::Actions& actions)
        : config_(config),
          kinematics_(config),
          pipe_(pipe),
          heating_(heating),
          motors_(motors),
          jogs_(config, actions) {}

    [[nodiscard]] bool away() const { return phase_ != Phase::on_path; }
    /// At rest beside the path: jogs are taken.
    [[nodiscard]] bool rests() const { return phase_ == Phase::parked; }
    /// Resumed, and waiting for the heat that it left with.
    [[nodiscard]] bool heats() const { return phase_ == Phase::heating; }
    /// The head has moved away from the part.
    [[nodiscard]] bool has_parked() const { return left_.parked; }
    /// The interpreter of the lines that are typed while the head rests here.
    [[nodiscard]] gcode::Interpreter& interpreter() { return jogs_; }
    /// Whose position people are shown.
    [[nodiscard]] const gcode::Interpreter& shown(const gcode::Interpreter& of_job) const {
        return rests() ? jogs_ : of_job;
    }

    // ---- before it leaves -----------------------------------------------------------------------

    /// The pause that comes next is of this kind.
    void order(const gcode::PauseOrder& order) { order_ = order; }
    /// The next pause begins when everything planned has been played (M0), or as soon as the motion
    /// can rest.
    void pause_at_end(bool at_end) { at_end_ = at_end; }
    [[nodiscard]] bool waits_for_end() const { return at_end_ && !pipe_.drained(); }
    /// A resume has come. True: it is put off, because the head is still on its way to the park
    /// place, or must yet park to heat up again.
    [[nodiscard]] bool defers_resume();

    // ---- away and back --------------------------------------------------------------------------

    /// The head leaves the path, over what is `printed`. Contract: the path is held and at rest.
    /// False: the head stays there, because not all axes are homed.
    [[nodiscard]] bool leave(const gcode::Interpreter& path, const HomingRun& homing,
                             const PrintedTop& printed);
    /// The head leaves the path, or where it is beside it, and does not come back: the job is over.
    /// Contract: the motion is held and at rest, and all axes are homed.
    void take_leave(const PrintedTop& printed);
    /// It is on its way.
    [[nodiscard]] bool takes_leave() const { return phase_ == Phase::taking_leave; }
    /// Waits for a person here.
    void stay();
    /// Asks for the heat that it left with. Contract: rests().
    void begin_return();

    enum class Step : std::uint8_t {
        goes_on,
        arrived,   ///< at the park place: stay()
        returned,  ///< on the path, still held
        left,      ///< for good
    };
    /// One look, once per release while away. Error: it came back to another place than it left.
    [[nodiscard]] Result<Step> advance();
    /// A resume was put off until now; true once.
    [[nodiscard]] bool take_deferred_resume() { return std::exchange(resume_wanted_, false); }

    /// The job is over, or the machine has a fault: there is no path to come back to.
    void forget();

  private:
    enum class Phase : std::uint8_t {
        on_path,
        leaving,       ///< on its way to the park place
        parked,        ///< there, or where it stopped when it may not park
        heating,       ///< resumed: waits for the heat that it left with
        returning,     ///< on its way back to the path
        taking_leave,  ///< on its way out, for good
    };
    /// How the path was left.
    struct Left {
        StepCounts steps{};  ///< at the stop
        double retracted_mm = 0;
        double filament_mm = 0;  ///< the planner's E after the retraction; the rest was jogged
        double load_mm = 0;      ///< to push at the park place before it comes back
        bool parked = false;     ///< the head has moved away
    };

    static constexpr double kRestAround_s = 0.1;

    void go(const motion::AxisVector& to, double speed_mm_s, double acceleration_mm_s2);
    void rest() {
        const bool fits = pipe_.planner().append_dwell(kRestAround_s);
        QDUINO_EXPECT(fits);
    }
    [[nodiscard]] double lifted(const motion::AxisVector& at) const;
    void plan_way_out();
    void plan_parking(motion::AxisVector& at);
    void plan_unloading(motion::AxisVector& at);
    void plan_loading(motion::AxisVector& at);
    [[nodiscard]] bool changes_filament() const {
        return order_.reason == gcode::PauseReason::filament_change;
    }
    void plan_way_back();
    void plan_detour(motion::AxisVector& at, const motion::AxisVector& to) const;
    [[nodiscard]] Result<Step> arrive_on_path();

    const MachineConfig& config_;
    Kinematics kinematics_;
    MotionPipe& pipe_;
    Heating& heating_;
    Motors& motors_;
    gcode::Interpreter jogs_;
    Phase phase_ = Phase::on_path;
    gcode::PauseOrder order_{};
    Left left_;
    PrintedTop printed_;          ///< what the head must go over, as of when it left
    bool resume_wanted_ = false;  // as soon as it is parked
    bool at_end_ = false;
};

}  // namespace qduino::printer::machine
