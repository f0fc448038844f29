// Carries out G-code on the parts of the printer.
//
//   Interpreter ──Actions──► JobActions ──► planner, places, heat, motors, homing, status
//                                  └── request: pause, stop, answer
//
// A long move goes to the planner in pieces, as it has room: so M220 and M221 change what is left
// of it, and a pause need not wait for its end. A line may do more behind a move (G28 behind a part
// that is left out goes up first, and then homes): that comes behind all of the move's pieces.
//
// An action of a job's line happens at its place in the motion, and so does a serial host's. A
// typed action happens at once, unless it moves. Three things only the machine can do: pause, stop,
// answer. A line that asks for one leaves a request here, and the machine takes it when the line is
// done; so no call goes back into the machine from inside the interpreter. Loop 1 only.
#pragma once

#include <optional>
#include <utility>
#include <variant>

#include "base/fixed_vector.h"
#include "printer/gcode/actions.h"
#include "printer/machine/bed_profiles.h"
#include "printer/machine/heating.h"
#include "printer/machine/homing_run.h"
#include "printer/machine/link_end.h"
#include "printer/machine/motion_pipe.h"
#include "printer/machine/motors.h"
#include "printer/machine/places.h"
#include "printer/machine/printed_top.h"
#include "printer/machine/speaker.h"

namespace qduino::printer::machine {

/// A line asks the machine to pause (M0), to stop at once (M112), or to answer (M105, M114, M115).
struct PauseAsked {
    gcode::PauseOrder order;  ///< its text has been shown, and is empty
};
struct EmergencyAsked {};
/// A person has taken heat that the running job counts on. Its targets are kept.
struct HeatTaken {
    gcode::Heater heater = gcode::Heater::hot_end;
    Celsius target{};
};
using Request = std::variant<PauseAsked, EmergencyAsked, HeatTaken, gcode::Report>;

class JobActions final : public gcode::Actions {
  public:
    /// All must outlive this.
    struct Parts {
        const MachineConfig& config;
        LinkEnd& link;
        MotionPipe& pipe;
        Motors& motors;
        Heating& heating;
        Places& places;
        HomingRun& homing;
        BedProfiles& profiles;
    };
    explicit JobActions(const Parts& parts) : parts_(parts) {}

    /// Whose the lines from here on are.
    void set_speaker(Speaker speaker) {
        speaker_ = speaker;
        parts_.link.answer_host(speaker == Speaker::host);
    }
    /// The request of the line just carried out; once.
    [[nodiscard]] std::optional<Request> take_request() { return std::exchange(request_, std::nullopt); }
    /// The motion has passed `place`.
    void pass(const Place& place);

    /// The top of what the job in hand, or the last one, has printed.
    [[nodiscard]] PrintedTop& printed() { return printed_; }
    /// A move has pieces left: go_on() before anything else is read.
    [[nodiscard]] bool has_rest() const { return rest_.has_value(); }
    /// Hands on the next piece. Contract: has_rest(), not away, and the planner has room.
    void go_on();
    void forget_rest() { rest_.reset(); }
    /// Filament in what is left of a move, mm.
    [[nodiscard]] double rest_filament_mm() const { return rest_ ? rest_->filament_mm : 0; }
    /// … as far as a flow factor changes it.
    [[nodiscard]] double rest_print_mm() const {
        return rest_ && rest_->move.kind == gcode::MoveKind::print ? rest_->filament_mm : 0;
    }

    Result<void> move(const gcode::Move& move) override;
    Result<void> dwell(Seconds duration) override;
    Result<void> home(gcode::AxisSet axes) override;
    Result<void> probe_bed() override;
    Result<void> change_bed(const gcode::BedChange& change) override;
    Result<void> set_temperature(gcode::Heater heater, Celsius target) override;
    Result<void> wait_temperature(gcode::Heater heater, Celsius target, gcode::WaitFor direction) override;
    Result<void> set_heater(gcode::Heater heater, const gcode::HeaterChange& change) override;
    Result<void> tune_heater(const gcode::TuningAsked& asked) override;
    Result<void> settings(gcode::SettingsAsked asked) override;
    Result<void> set_fan(std::uint8_t index, double duty) override;
    Result<void> motors_off(gcode::AxisSet axes) override;
    Result<void> motors_time_out(Seconds after) override {
        parts_.motors.time_out_after(from_seconds(after.value()));
        return {};
    }
    Result<void> set_limits(const gcode::LimitChange& change) override;
    Result<void> set_compensation(const gcode::CompensationChange& change) override;
    /// At once, also for what is left of a move.
    void factors(double speed, double flow) override;
    void message(std::string_view text) override { parts_.link.status().message.assign(text); }
    /// The slicer's claim (M73 P R) changes nothing: the printer has an estimate of its own.
    void progress(const gcode::Progress&) override {}
    void report(gcode::Report what) override { request_ = what; }
    Result<void> pause(const gcode::PauseOrder& order) override;
    void emergency_stop() override { request_ = EmergencyAsked{}; }
    void note(gcode::NoteKind kind, std::string_view text, const gcode::Source& source) override;

  private:
    /// A move that takes longer than this is handed on in pieces of about the second.
    static constexpr double kWhole_s = 0.6, kPiece_s = 0.4;

    /// What the planner has not been given of a move.
    struct Rest {
        gcode::Move move;
        Place done;              ///< at its end
        double share = 0;        ///< of its way, handed on
        double filament_mm = 0;  ///< left
        double speed_factor = 1;
        double flow_factor = 1;

        [[nodiscard]] motion::AxisVector place_at(double share_of_way) const;
    };

    [[nodiscard]] motion::Move as_move(const Rest& rest) const;
    void hand_on(const motion::AxisVector& from, const motion::AxisVector& to, const motion::Move& how);
    void finish(const Rest& rest);
    void finish_rest();
    /// Puts `action` behind everything planned so far; a typed one happens at once.
    void place(const PlaceAction& action);
    void mark(const Place& place);
    void perform(const PlaceAction& action);
    void append(const motion::AxisVector& to, double filament_mm, double speed_mm_s,
                double acceleration_mm_s2);
    /// It happens now, not at a place: typed; or beside the path of a job that runs.
    [[nodiscard]] bool acts_at_once() const {
        return speaker_ == Speaker::person || (speaker_ == Speaker::host && parts_.link.job_running());
    }
    [[nodiscard]] bool has_been_said(std::string_view text);
    [[nodiscard]] Result<void> check_homed_by_hand(const gcode::Move& move) const;

    Parts parts_;
    std::optional<Request> request_;
    std::optional<Rest> rest_;
    PrintedTop printed_;
    Speaker speaker_ = Speaker::job;
    FixedVector<std::size_t, 64> said_{};  // hashes of notes
    std::uint64_t said_by_job_ = 0;
};

}  // namespace qduino::printer::machine
