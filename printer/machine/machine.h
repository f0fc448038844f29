// The printer, sans I/O: what each of the paper's three loops does in one release.
//
//             job frames, commands                               ADC readings
//                    │                                                │
//   loop 1  plan() ──┼─► lines ─► interpreter ─► planner ─► solver ─► ring ─► loop 2 (the player)
//                    │                │ targets                       │
//                    │                └──────── four-slot ────► loop 3  heat_sample() ─► duties
//                    ▼
//             status, replies
//
// The machine puts its parts together. A part says that something happened; the machine decides
// what follows for the others. It is the only writer of the state (state.h), in to().
//
//   JobRun      the job's bytes, lines and outcome
//   JobActions  carries out G-code on the parts
//   Console     the typed lines, and a serial host's
//   HostLines   which of the host's are over
//   Places      the actions at places in the motion
//   MotionPipe  planner, solver and step ring
//   Heating     loop 3, as loop 1 sees it
//   HomingRun   homing, and which axes are homed
//   Parking     away from the path, and back
//   BaseSettings  what every job begins from
//   LinkEnd     commands in, words and the status out
//
// A failed or cancelled job leaves heaters and fan off. A running job that lost its heat because
// nobody used it is paused.
//
// Calling context is said per function. Nothing here reads a clock, allocates after construction,
// locks, or blocks. About 7 MB (the step ring, the filters): give it static storage.
#pragma once

#include "printer/gcode/emergency_scanner.h"
#include "printer/machine/base_settings.h"
#include "printer/machine/console.h"
#include "printer/machine/heating.h"
#include "printer/machine/homing_run.h"
#include "printer/machine/host_lines.h"
#include "printer/machine/job_actions.h"
#include "printer/machine/job_run.h"
#include "printer/machine/link_end.h"
#include "printer/machine/motion_pipe.h"
#include "printer/machine/motors.h"
#include "printer/machine/parking.h"
#include "printer/machine/places.h"
#include "printer/machine/state.h"
#include "printer/machine_config.h"

namespace qduino::printer::machine {

class Machine {
  public:
    /// `link` and `motors` must outlive the machine; the link's rings are read and its status
    /// written from here on.
    Machine(const MachineConfig& config, link::LinkLayout& link, MotorSwitch& motors);

    /// Loop 1: one release. Commands, waits, lines, planning, steps, status. Bounded work.
    void plan(Instant now);
    /// Loop 1: loop 3 has fallen silent; the caller must drive the heaters off itself.
    [[nodiscard]] bool heat_silent() const { return heating_.silent(); }

    /// Loop 2: the step ring, the stops to obey, and the way back for what was played.
    [[nodiscard]] MotionPipe& motion() { return pipe_; }

    /// Loop 3: one sample. The caller drives the duties onto the pins at once. An emergency stop
    /// cuts them here, too.
    [[nodiscard]] heat::HeatDuties heat_sample(Instant now, const heat::HeatReadings& readings);

  private:
    static constexpr int kLinesPerPlan = 2000;  // bounds loop 1's release: about 4 ms
    static constexpr int kLinesAtOnce = 32;
    static constexpr double kReadAtOnce_s = 0.05;  // of motion

    /// True: the state has changed. An event that is refused is answered on the console.
    bool to(Event event);

    void watch_heat(Instant now);
    void advance_tuning();
    void watch_motors(Instant now);
    void take_in_motion();
    void advance_homing(Instant now);
    void tell_place(bool homing);
    void advance_hold();
    void advance_excursion();
    [[nodiscard]] bool takes_leave();
    void end_left_job();

    void serve(const link::CommandText& command);
    void take_line(std::string_view line, Speaker speaker);
    [[nodiscard]] bool act_on(const gcode::EmergencyCodes& codes);
    void begin_host();
    void forget_settings();
    void stop_moves();
    void pause_job(bool at_end);
    void pause_without_heat(const HeatTaken& taken);
    void resume_job();
    void cancel_job();
    void clear_fault();

    /// A line that has been read has something left that is still to be handed on.
    [[nodiscard]] bool pending() const { return job_.interpreter().pending() || actions_.has_rest(); }
    [[nodiscard]] bool runs_at_once();
    [[nodiscard]] bool reads() const;
    void feed_motion();
    [[nodiscard]] bool read_input(int& lines);
    bool read_line();
    void proceed_pending();
    [[nodiscard]] bool console_is_ready();
    void run_typed_line();
    void settle_host_line();
    void heed_request();

    void stop_job(link::JobOutcome outcome, std::string_view why);
    void end_job(const JobEnding& ending);
    void enter_fault(std::string_view why);
    [[nodiscard]] link::Activity activity() const;
    [[nodiscard]] gcode::Position position_shown();
    void publish(Instant now);

    MachineConfig config_;
    LinkEnd link_;
    State state_ = State::starting;
    Motors motors_;
    MotionPipe pipe_;
    Heating heating_;
    Places places_;
    HomingRun homing_;
    BedProfiles profiles_;
    BaseSettings base_;
    JobActions actions_;
    Parking parking_;
    JobRun job_;
    Console console_;
    HostLines host_;
};

}  // namespace qduino::printer::machine
