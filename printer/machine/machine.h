// The printer, sans I/O: its states, and what each of the paper's three loops does in one release.
//
//             job frames, commands                                   ADC readings
//                    │                                                    │
//   loop 1  plan() ──┼─► lines ─► interpreter ─► planner ─► solver ─► ring│ ─► loop 2  (player, sketch side)
//                    │                │ targets                           │
//                    │                └──────── four-slot ──────► loop 3  heat_sample() ─► duties
//                    ▼
//             status, replies
//
// States (link::MachineState):
//
//   starting ─► idle ─► printing ─► pausing ─► paused ─► printing
//                 ▲         │  └──────────► cancelling ◄──┘
//                 │  played │                   │
//                 └─────────┴───────────────────┘        any ── fault, emergency ──► faulted ── clear_fault ──► idle
//
// `pausing` lasts until the head is parked; a job that is resumed is `printing` from then on, while it heats up and goes
// back, too. A running job that lost its heat because nobody used it is paused.
//
// A job runs from its job_begin frame until every byte has been read and every move played (completed), or
// until it is cancelled, or until a line of it fails or the machine faults (failed). A failed or cancelled
// job leaves heaters and fan off. What a line says is checked before anything moves; the first bad line ends
// the job where it stands.
//
// Calling context is said per function. Nothing here reads a clock, allocates after construction, locks, or
// blocks. About 6 MB (the step ring): give it static storage.
#pragma once

#include <atomic>
#include <optional>

#include "base/fixed_vector.h"
#include "channel/broadcast.h"
#include "printer/gcode/annotation.h"
#include "printer/gcode/interpreter.h"
#include "printer/gcode/parser.h"
#include "printer/heat/heat_control.h"
#include "printer/link/frame.h"
#include "printer/link/layout.h"
#include "printer/machine/homing.h"
#include "printer/machine/job_receiver.h"
#include "printer/machine/motion_pipe.h"
#include "printer/machine/place_queue.h"
#include "printer/machine_config.h"

namespace qduino::printer::machine {

/// The drivers' ENABLE pins, switched from loop 1 before the first step of an axis and after M84.
class MotorSwitch {
  public:
    virtual ~MotorSwitch() = default;
    virtual void switch_motor(Axis axis, bool on) = 0;
};

class Machine final : private gcode::Actions {
  public:
    /// `link` and `motors` must outlive the machine; the link's rings are read and its status written from
    /// here on.
    Machine(const MachineConfig& config, link::LinkLayout& link, MotorSwitch& motors);

    // ---- loop 1 -------------------------------------------------------------------------------------------

    /// One release: commands, waits, lines, planning, steps, status. Bounded work.
    void plan(Instant now);

    // ---- loop 2 -------------------------------------------------------------------------------------------

    [[nodiscard]] StepRing& step_ring() { return pipe_.ring(); }
    /// Differs from the last one served: drop every step, now. Emergency stops of the service are in it.
    [[nodiscard]] std::uint32_t stop_asked() const { return pipe_.stop_asked(); }
    /// An emergency stop that loop 1 has not taken in yet: nothing may move, whatever comes off the ring.
    [[nodiscard]] bool emergency_pending() const {
        return link_.emergency.load(std::memory_order_acquire) !=
               emergency_taken_.load(std::memory_order_acquire);
    }
    /// Everybody who reads loop 2's status: loop 1, loop 3, the service.
    [[nodiscard]] channel::Broadcast<link::MotionStatus, 3> motion_readers() {
        return channel::Broadcast<link::MotionStatus, 3>{
            {&pipe_.feedback(), &motion_for_heat_, &link_.motion_status}};
    }

    // ---- loop 3 -------------------------------------------------------------------------------------------

    /// One sample; the caller drives the duties onto the pins at once. An emergency stop cuts them here, too.
    [[nodiscard]] heat::HeatDuties heat_sample(Instant now, const heat::HeatReadings& readings);

    // ---- any time, from loop 1's context ------------------------------------------------------------------

    [[nodiscard]] const MachineConfig& config() const { return config_; }
    [[nodiscard]] const link::JobStatus& status() const { return status_; }
    /// Loop 3 has not sampled for kHeatSilence: the caller must drive the heaters off itself.
    [[nodiscard]] bool heat_silent() const { return heat_silent_; }
    static constexpr Nanoseconds kHeatSilence = 500ms;

  private:
    static constexpr int kLinesPerPlan = 2000;  // bounds loop 1's release: about 4 ms
    static constexpr int kCommandsPerPlan = 32;
    static constexpr std::size_t kTypedMax = 16;

    /// Where the head is while a job is paused.
    enum class Away : std::uint8_t {
        no,         ///< on the path
        leaving,    ///< on its way to the park place
        parked,     ///< there, or where it stopped when it may not park: jogs are taken
        heating,    ///< resumed: waits for the heat that it left with
        returning,  ///< on its way back to the path
    };
    /// How the path was left.
    struct Left {
        std::array<std::int64_t, kAxisCount> steps{};  ///< pulse counts at the stop
        double retracted_mm = 0;
        double filament_mm = 0;  ///< the planner's E after the retraction: what differs from it was jogged
        bool parked = false;     ///< the head has moved away
    };
    struct KeptTargets {
        Celsius hot_end{};
        Celsius bed{};
    };

    enum class Wait : std::uint8_t { nothing, temperature, homing };

    // One release, in order (plan.cpp).
    void watch_emergency();
    void watch_heat(Instant now);
    void pass_places();
    void finish_stop();
    void advance_wait(Instant now);
    void advance_hold();
    void read_input();
    bool read_line();
    bool read_job();
    void finish_job_when_played();
    void publish(Instant now);

    // Commands of the service (commands.cpp).
    void serve_commands();
    void serve(const link::CommandText& command);
    void pause_job();
    void resume_job();
    void cancel_job();
    void clear_fault();
    void run_typed_line();
    void answer_typed_lines();
    [[nodiscard]] Result<void> may_type(const gcode::Command& command) const;

    [[nodiscard]] std::string_view persisting_fault() const;

    // Leaving the path during a pause, and coming back to it (parking.cpp).
    void leave_path();
    void plan_parking();
    void advance_excursion();
    void stay_parked();
    void begin_return();
    void plan_return();
    void finish_return();
    void forget_excursion();
    void watch_idle();
    void keep_targets();
    void note_request(gcode::Heater heater, Celsius target);
    [[nodiscard]] bool is_warm_again() const;
    [[nodiscard]] Result<void> check_homed_for_jog(const gcode::Move& move) const;
    /// Whose position people are shown.
    [[nodiscard]] const gcode::Interpreter& shown_interpreter() const {
        return away_ == Away::parked ? jog_interpreter_ : interpreter_;
    }

    // Jobs and how they end (jobs.cpp).
    void begin_job();
    void on_job_line(const gcode::Line& line);
    void on_comment(std::string_view comment);
    void stop_job(link::JobOutcome outcome, std::string_view why);
    void end_job(link::JobOutcome outcome, std::string_view why);
    void enter_fault(std::string_view why);
    void heat_off();
    void forget_homed();
    void reply(link::ReplyKind kind, std::string_view text);

    // Homing (homing_run.cpp).
    void advance_homing(Instant now);
    void start_homing_order(Instant now);
    void homing_order_ended(bool pressed);
    void homing_failed(const char* why);
    void settle_axis();

    // What the interpreter asks for (actions.cpp).
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

    /// Puts `action` behind everything planned so far; what is typed happens at once.
    void place(PlaceAction action);
    void perform(const PlaceAction& action);
    void switch_motors(const motion::AxisVector& from, const motion::AxisVector& to);
    [[nodiscard]] Result<void> check_cold(double filament_mm) const;
    [[nodiscard]] bool temperature_reached(Instant now);
    [[nodiscard]] bool job_running() const { return receiver_.running(); }
    [[nodiscard]] bool may_read() const;
    /// Everybody agrees that the machine is at `position` and at rest.
    void adopt_position(const motion::AxisVector& position);

    MachineConfig config_;
    link::LinkLayout& link_;
    MotorSwitch& motors_;
    gcode::Interpreter interpreter_;
    gcode::Interpreter jog_interpreter_;  // of what is typed while the head is away from the path
    gcode::Parser parser_;
    heat::HeatControl heat_;
    heat::HeatTargets targets_;
    MotionPipe pipe_;
    PlaceQueue places_;
    Homing homing_;
    JobReceiver receiver_;
    link::FrameReader command_reader_;
    FixedVector<FixedString<gcode::kCommandBytesMax>, kTypedMax> typed_;

    link::JobStatus status_;
    link::HeatStatus heat_seen_;
    Instant heat_alive_{};
    bool heat_silent_ = false;
    std::array<bool, kAxisCount> motor_on_{};
    gcode::LayerCounter layers_;
    std::atomic<std::uint32_t> emergency_taken_{0};
    channel::FourSlot<link::MotionStatus> motion_for_heat_;  // loop 2 writes, loop 3 reads

    Away away_ = Away::no;
    Left left_;
    bool resume_wanted_ = false;               // as soon as it is parked
    std::optional<KeptTargets> kept_targets_;  // in force when the job was paused, or lost its heat

    bool input_complete_ = false;  // every byte of the job has been parsed
    bool input_dry_ = true;        // nothing was there to read at the last try
    bool from_console_ = false;    // the command in hand was typed
    bool pause_at_end_ = false;    // M0: pause when everything has been played, not earlier
    bool stop_running_ = false;    // loop 2 was asked to drop everything
    link::JobOutcome stop_outcome_ = link::JobOutcome::none;  // while cancelling: how the job will have ended
    FixedString<236> stop_why_;

    Wait wait_ = Wait::nothing;
    gcode::Heater wait_heater_ = gcode::Heater::hot_end;
    gcode::WaitFor wait_direction_ = gcode::WaitFor::heating;
    double wait_target_ = 0;
    std::optional<Instant> at_target_since_;

    /// As of what has been played; the interpreter counts on what it has read, an M84 at the end of the job, say.
    std::array<bool, 3> homed_{};
    std::array<std::int64_t, kAxisCount> origin_{};  // pulse counts at machine position 0
    bool homing_order_running_ = false;
    Instant homing_settled_{};
    std::uint32_t homing_hits_before_ = 0;
    std::int64_t homing_steps_before_ = 0;

    Instant last_plan_{};
    bool planned_before_ = false;
    double acceleration_print_ = 0;
    double acceleration_travel_ = 0;
    double acceleration_filament_ = 0;
};

}  // namespace qduino::printer::machine
