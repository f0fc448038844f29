// The asked path: what a G-code file demands of the machine, as straight pieces in machine
// coordinates, read lazily.
//
// Geometry alone. Feed rates, heat and everything else change when a part is made, never which
// part. The dialect is Marlin's, with Klipper's words where slicers write them (docs/sources.md):
// - G90/G91 set E along with X Y Z; M82/M83 set E alone afterwards. That is Marlin's: in a file of
//   RepRapFirmware's or Klipper's they leave E's mode alone, and in G91 E counts on all the same.
//   A file says whose it is by its words, from there on (asked_lines.h).
// - M221 scales every E movement from then on; the words still mean unscaled filament. M200 makes
//   them mm³. M92 E says how many steps a millimetre of filament takes: it scales what E must do.
//   A M221 that a person types takes hold within the line that is made just then.
// - G92 renames the present position (nothing moves; without a letter every axis is 0, and so is an
//   axis whose letter stands alone). G28 also forgets the G92 of the axes that it homes. M206, M428
//   and SET_GCODE_OFFSET shift the coordinates, and outlast a G28.
// - G10 draws the filament back by M207's length and lifts by its Z; G11 undoes both, and pushes
//   M208's length on top. Neither changes what the words of E count from.
// - Arcs and splines become chords: asked_curve.h. Words may be macros: asked_lines.h.
// - From the first move of an object that is left out (asked_objects.h) until a line behind it goes
//   sideways, the head waits where it was; firmware retractions are made there. That line first
//   takes it to its own end: up, sideways, down. The filament is drawn back before, or pushed again
//   after it, to where the program takes it to be.
// - Behind the object, what frees the part is done at once: filament drawn back, a way up. A way
//   down belongs to another place, and is owed until the head is there.
// - A G28, a G29, motors that go off and the end of the file find the head as high as the program
//   is, with its filament. A G28 gives it the places of its axes; the others are owed still.
//
// Invariant: each item starts where the one before it ended; items that move nothing are not given.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "twin/asked_bed.h"
#include "twin/asked_curve.h"
#include "twin/asked_lines.h"
#include "twin/asked_objects.h"
#include "twin/byte_source.h"
#include "twin/compensation.h"
#include "twin/gantry.h"
#include "twin/machine.h"

namespace qduino::twin {

struct AskedItem {
    /// probe: the bed is measured; the item ends where the head is then.
    enum class Kind : std::uint8_t { move, home, probe, end };
    Kind kind = Kind::end;
    std::uint8_t homed = 0;  ///< home: bit per slide
    bool curved = false;     ///< move: a chord of an arc or of a spline
    std::uint64_t line = 0;
    Position to{};         ///< where this item ends, as asked
    double advance_s = 0;  ///< pressure advance that was asked for
    AskedCorrection correction{};
};

class AskedPath {
  public:
    /// `start`: the machine's position before the first line. `machine`: the coordinates of its
    /// switches count, and what a step of E pushes.
    /// `compensation`: as the machine file says. `bed`: as it is behind an earlier job of the
    /// session.
    AskedPath(ByteSource& source, const Position& start, const Machine& machine,
              const Compensation& compensation, const AskedBed& bed);
    AskedPath(ByteSource& source, const Position& start, const Machine& machine)
        : AskedPath(source, start, machine, Compensation{machine}, AskedBed{machine}) {}

    /// The next item; Kind::end for ever once the source has ended.
    [[nodiscard]] AskedItem next();
    [[nodiscard]] const AskedBed& bed() const { return bed_; }
    /// A machine is so many lines further, at most, when the twin hears what was typed.
    static constexpr std::size_t kLineEnds = 256;
    /// From a place in a line on, all filament is `factor` times what was given out before.
    struct Stretch {
        std::uint64_t line = 0;
        double from_mm = 0;  ///< where E is there
        double left_mm = 0;  ///< of the line's filament behind it
        double factor = 1;

        [[nodiscard]] double moved(double e_mm) const { return from_mm + (e_mm - from_mm) * factor; }
    };
    /// AskedLines::insert. What it changes of items that have been given out already, if anything.
    [[nodiscard]] std::optional<Stretch> insert(std::uint64_t behind, std::string_view line, double left_mm);
    /// The end of the items given out so far.
    [[nodiscard]] const Position& position() const { return machine_; }

    /// Sum of all E movements given out so far, and of the positive ones, in mm.
    [[nodiscard]] double filament_net_mm() const { return filament_.net_mm; }
    [[nodiscard]] double filament_pushed_mm() const { return filament_.pushed_mm; }
    /// In force behind the lines read so far.
    [[nodiscard]] const Compensation& compensation() const { return compensation_; }

  private:
    /// M207, M208: Marlin's defaults.
    struct Retraction {
        double length_mm = 3, lift_mm = 0, extra_mm = 0;
        bool drawn = false;
        double drawn_mm = 0, lifted_mm = 0;  ///< by the G10 in force
    };
    using Slides = std::array<double, kSlideCount>;
    /// The offsets from words to coordinates: machine = word + total, for X, Y, Z.
    struct Offsets {
        Slides total{};   ///< G92 and the two below
        Slides home{};    ///< M206: taken off, also after a G28
        Position code{};  ///< SET_GCODE_OFFSET: added, also after a G28
    };
    struct Filament {
        double programmed = 0;  ///< what the words of E have counted to: from 0 in each job
        double flow = 1;
        double steps_per_mm = 1;    ///< of the machine's extruder
        double scale = 1;           ///< M92 E
        double diameter_mm = 1.75;  ///< M200 D
        bool volumetric = false;
        double peak_mm = 0;  ///< the furthest that E of the program has been
        double net_mm = 0;
        double pushed_mm = 0;

        /// The unit of a word of E: millimetres, or while extrusion is volumetric mm³.
        [[nodiscard]] double unit(double unit_mm) const {
            return volumetric ? unit_mm * unit_mm * unit_mm : unit_mm;
        }
        [[nodiscard]] double mm_per_word() const;
        void run_m200(const CommandLine& command, double unit_mm);
    };
    struct Modes {
        double unit_mm = 1;
        bool relative = false;     ///< G91
        bool relative_e = false;   ///< M83
        bool axes_rule_e = false;  ///< Marlin's: a G90 or G91 came after the last M82 or M83
        Plane plane = Plane::xy;

        [[nodiscard]] bool e_counts_on(Flavour flavour) const;
    };
    /// SAVE_GCODE_STATE.
    struct Saved {
        Modes modes{};
        Offsets offsets{};
        Position program{};
        double lifted_mm = 0;
        double programmed_e = 0;
        double flow = 1;
    };
    /// The head waits while an object is left out, and then until a line goes sideways.
    struct Waiting {
        bool active = false;
        double drawn_mm = 0;  ///< filament drawn back when it began to wait
    };

    /// Where E was at the end of a line.
    struct LineEnd {
        std::uint64_t line = 0;
        double e_mm = 0;
    };
    /// What a person's line may have to change.
    struct Typed {
        std::deque<LineEnd> line_ends;
        std::optional<Stretch> stretched;  ///< … of those, by the line that was typed last
    };
    /// Where the machine knows to be.
    struct Known {
        Slides home_mm{};
        Position probed_at{};    ///< where the head is when the bed has been measured
        std::uint8_t homed = 0;  ///< slides, by the job itself
    };
    struct End {
        bool over = false;   ///< M2, M30: what stands behind is not asked
        bool given = false;  ///< and what the end asks for has been given
    };
    void run(const CommandLine& command);
    void run_typed();
    void note_line_end();
    void change_flow(const CommandLine& command);
    void stretch(Stretch by);
    void run_g(const CommandLine& command);
    void run_m(const CommandLine& command);
    void move(const Position& to);
    void begin_curve(const CommandLine& command);
    void home(const CommandLine& command);
    void probe();
    void draw_back();
    void push_again();
    void rename(const CommandLine& command);
    void set_home_offset(std::size_t axis, double mm);
    void centre_home();
    void shift(const CommandLine& command);
    void restore(const CommandLine& command);
    void forget_places(const CommandLine& command);
    [[nodiscard]] Position target(const CommandLine& command);
    void begin_waiting(const Position& to);
    void follow(const Position& to, bool curved = false);
    void follow_retraction(const Position& to);
    void rejoin(const Position& to);
    void bring(double filament_mm);
    void draw_owed();
    void leave_part();
    void rise(double z_mm);
    void stop_waiting();
    [[nodiscard]] double owed_mm() const;
    void give(const Position& to, bool curved);

    AskedLines lines_;
    AskedObjects objects_;
    Compensation compensation_;
    AskedBed bed_;
    Known known_{};
    Gantry gantry_;
    Position program_;  // where the lines read so far lead
    Position machine_;  // where the items lead: behind while the head waits
    Waiting waiting_{};
    Offsets offsets_{};
    Filament filament_{};
    Modes modes_{};
    Retraction retraction_{};
    std::map<std::string, Saved> saved_{};
    std::optional<Flavour> flavour_;  // of every job
    End end_{};
    AskedCurve curve_{};
    std::deque<AskedItem> given_;  // of the line in hand
    Position out_{};               // the end of the last item that was given out
    Typed typed_{};
};

}  // namespace qduino::twin
