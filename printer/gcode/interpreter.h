// Commands to actions: the modal state of G-code, and one small handler for every code.
//
//   G20 G21           units of length            F            modal speed
//   G90 G91 M82 M83   absolute or relative       M220 M221    factors of speed and flow
//   G92 M206          where zero is              G10 G11      retraction
//   G17 G18 G19       the plane of arcs          M200 M92     what a word of E pushes
//
// All of it lives in ModalState, and nowhere else.
//
// Here, and in no other place, a speed is mm/min (it is divided by 60 at once), a length may be
// inches, and a coordinate may be relative.
//
// Invariants
// - A command that fails changes nothing: not the modal state, not the position. Its error names
//   the line, the code, what is wrong and which limit it breaks. (An arc or a G10 that the machine
//   refuses half-way stands where it was refused.)
// - Every move that is handed on is finite and inside the machine's bounds, for X, Y, Z from
//   AxisConfig.
// - What is not understood and may move is refused: an unknown G-code, an unknown word. Any other
//   unknown code is noted and skipped.
//
// Semantics follow Marlin (marlinfw.org/meta/gcode) where slicers rely on it: G90/G91 set E's mode
// as well, unless the job is written for a firmware that leaves E alone (dialect.h); G28 takes the
// axes it homes out of G92's offset. G92 without axes zeroes all, as in Klipper. Words are
// Klipper's, and the macros of the machine file.
#pragma once

#include <cstdint>
#include <limits>

#include "base/result.h"
#include "printer/gcode/context.h"

namespace qduino::printer::gcode {

struct Line;

class Interpreter {
  public:
    static constexpr std::size_t kAllMoves = std::numeric_limits<std::size_t>::max();

    /// Both must outlive the interpreter. The tool is taken to stand at the home position until
    /// told otherwise.
    Interpreter(const MachineConfig& machine, Actions& actions);

    /// Carries out one command. A curve hands on at most `moves_max` (1 or more) moves, and a macro
    /// has one line carried out at a time: the rest stays pending. G10 and G11 make up to two
    /// moves, every other command at most one, and four more where the head comes back from an
    /// object that was left out. Contract: nothing is pending.
    Result<void> execute(const Command& command, std::size_t moves_max = kAllMoves);

    /// Carries out a command that takes hold at once, whatever is pending. Contract: it may be
    /// typed while a job prints (may_be_typed()).
    Result<void> execute_beside(const Command& command);

    /// To be called for every line of a job before it is carried out: it may say whose dialect the
    /// job is written in (dialect.h). Error: lines before it have been read in another, and mean
    /// something else in this one; from here on it counts all the same.
    Result<void> heed(const Line& line);

    /// A curve has pieces left, or a macro lines: proceed() must empty it before the next command.
    [[nodiscard]] bool pending() const { return context_.curve.has_value() || context_.lines.active(); }
    /// Hands on up to `moves_max` pieces of the pending curve, or carries out the next line. After
    /// an error nothing is pending. kAllMoves: until nothing is.
    Result<void> proceed(std::size_t moves_max = kAllMoves);

    /// The machine stands somewhere else than the moves said: after a cancelled job, a failed
    /// homing. Drops a pending curve. X, Y, Z keep G92's offset; E keeps its programmed value, and
    /// the filament is drawn back as far as it was. A head that waits while an object is left out
    /// waits there.
    void set_position(const Position& machine) {
        context_.curve.reset();
        context_.stand_at(machine);
    }
    /// The job has come to its M2 or M30: the reader of a job carries out nothing behind it. Lines
    /// that are typed or sent by a host end nothing.
    [[nodiscard]] bool program_ended() const { return context_.program_ended; }
    /// The job has been read to its end: a head that waits leaves the part, as far as the program
    /// has. Up to three moves. Contract: nothing is pending.
    Result<void> finish();
    /// What is left of a curve or of a macro is not carried out.
    void drop_pending() {
        context_.curve.reset();
        context_.lines.clear();
    }
    /// Homed or not, by an event outside of G-code (a motor switched off, a fault).
    void set_homed(Axis axis, bool homed) {
        QDUINO_EXPECT(axis != Axis::e);
        context_.state.set_homed(axis, homed);
    }
    /// The skew in force, by an event outside of this interpreter's lines.
    void set_skew(const SkewConfig& skew) { context_.state.skew = skew; }
    /// Takes M220's and M221's factors over from another interpreter.
    void adopt_factors(const ModalState& from);
    /// Leaves out as well the objects that another interpreter was told to.
    void adopt_exclusions(const Interpreter& from) { context_.objects.adopt(from.context_.objects); }
    /// Grows whenever it changes which objects are left out.
    [[nodiscard]] std::uint32_t exclusions() const { return context_.objects.changes(); }
    /// To the state at start (modes, offsets, factors, retraction); position and homing stay. For
    /// the next job.
    void reset_modes();

    [[nodiscard]] const ModalState& state() const { return context_.state; }
    /// What M114 says: the position as the program counts it, in millimetres.
    [[nodiscard]] Position programmed_position() const;
    /// … as it is while the machine is at `machine` on its way there, and `behind` of the filament
    /// is still to be pushed.
    [[nodiscard]] Position programmed_position(const Position& machine, Millimetres behind) const;
    [[nodiscard]] bool homed(Axis axis) const { return context_.state.homed[axis]; }

    // Counted since construction or reset_modes().
    [[nodiscard]] std::uint32_t unknown_codes() const { return unknown_codes_; }
    [[nodiscard]] std::uint32_t codes_not_done() const { return codes_not_done_; }
    [[nodiscard]] std::uint32_t warnings() const { return context_.warnings; }

  private:
    Result<void> dispatch(const Command& command, std::size_t moves_max);
    Result<void> expand(const Command& command, const Macro& macro);
    Result<void> proceed_on_curve(std::size_t moves_max);
    Result<void> proceed_with_lines(std::size_t moves_max);
    Result<void> skip(const Command& command, const CodeInfo* code);

    Context context_;
    bool in_lines_ = false;  ///< the command in hand is a line of a macro
    std::uint32_t unknown_codes_ = 0;
    std::uint32_t codes_not_done_ = 0;
};

}  // namespace qduino::printer::gcode
