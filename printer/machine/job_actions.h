// What G-code asks for, carried out on the parts of the printer.
//
//   Interpreter ──Actions──► JobActions ──► planner, places, heat, motors, homing, status
//                                  └── request: what only the machine can do (pause, stop,
//                                      answer); it is taken when the line is done
//
// What a job's line asks for happens at its place in the motion. What is typed happens at once,
// unless it moves. Loop 1 only.
#pragma once

#include <optional>
#include <utility>
#include <variant>

#include "printer/gcode/actions.h"
#include "printer/machine/heating.h"
#include "printer/machine/homing_run.h"
#include "printer/machine/link_end.h"
#include "printer/machine/motion_pipe.h"
#include "printer/machine/motors.h"
#include "printer/machine/places.h"

namespace qduino::printer::machine {

/// A line asks the machine to pause (M0), to stop at once (M112), or to answer (M105, M114, M115).
struct PauseAsked {};
struct EmergencyAsked {};
using Request = std::variant<PauseAsked, EmergencyAsked, gcode::Report>;

class JobActions final : public gcode::Actions {
  public:
    /// What is acted on; all must outlive this.
    struct Parts {
        const MachineConfig& config;
        LinkEnd& link;
        MotionPipe& pipe;
        Motors& motors;
        Heating& heating;
        Places& places;
        HomingRun& homing;
    };
    explicit JobActions(const Parts& parts) : parts_(parts) {}

    /// Whether what follows was typed, or comes from the job.
    void set_typed(bool typed) { typed_ = typed; }
    /// What the line in hand asked the machine for; once.
    [[nodiscard]] std::optional<Request> take_request() { return std::exchange(request_, std::nullopt); }
    /// The motion has passed `place`.
    void pass(const Place& place);

    Result<void> move(const gcode::Move& move) override;
    Result<void> dwell(Seconds duration) override;
    Result<void> home(gcode::AxisSet axes) override;
    Result<void> set_temperature(gcode::Heater heater, Celsius target) override;
    Result<void> wait_temperature(gcode::Heater heater, Celsius target, gcode::WaitFor direction) override;
    Result<void> set_fan(std::uint8_t index, double duty) override;
    Result<void> motors_off(gcode::AxisSet axes) override;
    Result<void> set_limits(const gcode::LimitChange& change) override;
    void factors(double speed, double flow) override;
    void message(std::string_view text) override;
    void progress(const gcode::Progress& progress) override;
    void report(gcode::Report what) override;
    Result<void> pause(gcode::PauseReason reason, std::string_view text) override;
    void emergency_stop() override;
    void note(gcode::NoteKind kind, std::string_view text, const gcode::Source& source) override;

  private:
    /// Puts `action` behind everything planned so far; what is typed happens at once.
    void place(const PlaceAction& action);
    void mark(const Place& place);
    void perform(const PlaceAction& action);
    [[nodiscard]] Result<void> check_homed_for_jog(const gcode::Move& move) const;

    Parts parts_;
    std::optional<Request> request_;
    bool typed_ = false;
};

}  // namespace qduino::printer::machine
