// One job from its first frame to its outcome: its bytes become lines, its lines become actions.
//
//   link.jobs ─► JobReceiver ─► Parser ─► Interpreter ─► Actions
//                                  └► layer comments ─► Places ◄─ extrusions (Actions)
//
// A job runs from its job_begin frame until every byte has been read and every move played
// (completed), or until it is cancelled, or until a line of it fails or the machine faults
// (failed). A line is checked before anything moves; the first bad line ends the job where it
// stands.
//
// Loop 1 only; no heap.
#pragma once

#include <optional>

#include "base/time.h"
#include "printer/gcode/annotation.h"
#include "printer/gcode/interpreter.h"
#include "printer/gcode/parser.h"
#include "printer/gcode/reports.h"
#include "printer/machine/job_receiver.h"
#include "printer/machine/link_end.h"
#include "printer/machine/motion_pipe.h"
#include "printer/machine/places.h"
#include "printer/machine/vectors.h"

namespace qduino::printer::machine {

/// How a job ends, and why if not well.
struct JobEnding {
    link::JobOutcome outcome = link::JobOutcome::none;
    FixedString<236> why{};
};

class JobRun {
  public:
    /// All must outlive this.
    JobRun(const MachineConfig& config, gcode::Actions& actions, LinkEnd& link, Places& places)
        : link_(link), places_(places), interpreter_(config, actions) {}

    [[nodiscard]] bool running() const { return link_.job_running(); }
    /// Every byte of it has been read, and what its end asks for (Interpreter::finish) is done.
    [[nodiscard]] bool read_to_end() const { return finished_; }
    /// How far it is by the printer's own estimate, which the service has made. Zeros: no job
    /// runs, or it came without one.
    [[nodiscard]] gcode::PrintProgress progress() const;
    [[nodiscard]] gcode::Interpreter& interpreter() { return interpreter_; }
    [[nodiscard]] const gcode::Interpreter& interpreter() const { return interpreter_; }

    /// The tool rests somewhere else than the lines said: a stop, or an axis that was homed.
    void stands_at(const motion::AxisVector& position_mm) {
        interpreter_.set_position(to_position(position_mm));
    }

    enum class Read : std::uint8_t {
        nothing,  ///< nothing is there now
        begun,    ///< a job has begun
        some,     ///< of its bytes
    };
    /// Reads one line, or a part of one, and carries it out. Error: the line fails. Contract: the
    /// interpreter has nothing pending.
    [[nodiscard]] Result<Read> read();
    /// For a machine that has a fault. True: a job has arrived and is begun, but not read; the
    /// caller ends it.
    [[nodiscard]] bool take_arrival();

    /// A typed line has changed which objects are left out of the lines to come, or how much
    /// filament they take. `left_mm`: what the line in hand still had to lay down before.
    void note_typed_object(std::string_view line, double left_mm);

    /// How it will have ended when everything is at rest.
    void will_end(const JobEnding& ending) { ending_ = ending; }
    [[nodiscard]] const JobEnding& ending() const { return ending_; }
    /// No more of it is read. Does little without a job: when typed motion is cancelled.
    void end(const JobEnding& ending);

    /// Brings its numbers in the status up to date. `counts`: the time since the last call is time
    /// of printing; `waits_for_heat`: and of waiting for heat.
    void publish(Instant now, bool counts, bool waits_for_heat);

  private:
    void begin();
    [[nodiscard]] Result<void> carry_out(const gcode::Line& line);

    LinkEnd& link_;
    Places& places_;
    JobReceiver receiver_;
    gcode::Parser parser_;
    gcode::Interpreter interpreter_;
    JobEnding ending_;
    bool read_to_end_ = false;
    bool finished_ = false;
    std::uint64_t last_line_ = 0;  ///< that held a command
    std::optional<Instant> published_;
};

}  // namespace qduino::printer::machine
