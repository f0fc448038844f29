// Inspector: is the part that was built the part that was asked for? Built is a stream of
// microsteps. Asked is a path of straight pieces in (x, y, z, e). No clock is needed: the order of
// the steps alone tells where on the path the machine is.
//
// A perfect machine stands at the whole step nearest to the path, so it steps exactly where the
// path crosses a half step:
//
//   x  3 ┤                 ╭──built──     asked(s) ╱
//      2 ┤         ╭───────╯        ╱·  ← at this step of X the path is at x = 2½. That gives s;
//      1 ┤ ╭───────╯        ╱·         every other axis must stand within half a step of asked(s)
//      0 ┼─╯      ╱·
//        └──────────────────────────── s
//
// For every step of axis A to n, the cursor s moves forward to the first place where asked_A
// reaches the boundary n ∓ ½. It never moves back: a step whose boundary lies behind s is late, and
// moves nothing. Then the distance |built − asked(s)| of every axis is noted. Perfect stepping
// gives at most ½ step (plus the order in which near-simultaneous steps were sent).
//
// A wrong step must not drag the cursor along. A step is unexplained if only leaving another axis
// more than kAstraySteps behind could explain it. It is counted, noted with its deviation, and s
// stays. Each further unexplained step widens that limit by one, so that after lost steps the
// comparison finds its place again (and reports them).
//
// Where a delta's carriage turns back it nearly stands, and .01 of a step is a long way: its
// crossing is known to a fifth of a millimetre only. So there a step takes the cursor to the first
// place that explains it but for a tie, never past it. The other carriages take it on.
//
// The extruder follows and does not lead: a step of E moves s only as far as no slide is
// contradicted. A slide that turns back behind its half-step may leave out the pair (turn.h): E
// goes on then. After an earlier job it is unknown where E's zero lies within a microstep, and one
// microstep of filament is 25 of the slides.
//
// Curves. A firmware makes chords of its own of an arc. Near the place where the arc turns back, a
// chord that is 5 µm beside it crosses a half step half a millimetre early, or never. So on curves
// the cursor does not follow crossings. It moves forward to the place of the true curve that is
// nearest to where the slides stand, and the distance from there, square to the curve, is noted:
//
//        built ●               deviation = the part of (built − asked(s)) square to the curve; at
//          ´  ↕ ` .            most 0.71 steps and what the firmware's chord is off. How far along
//      ´  asked(s)   `         the curve the slides stand is told by E alone.
//
// Deviations from curves are noted apart from those of straight pieces, with a tolerance of their
// own (report.h).
//
// All this is in steps of motors (gantry.h). On a cartesian machine and on CoreXY a straight piece
// of the path is one for every motor. On a delta it is a curve for each carriage: the path is cut
// into pieces so short that no carriage leaves its chord by more than kChordSteps.
//
// Homing: at a G28 the steps of the motors that move its slides are skipped until homing_watch.h
// finds these home. The place where a slide then stands gets the coordinate of the switch
// (home_mm). A motor stands on a whole step, so its coordinate is rounded to one.
//
// Probing: from the first step of a G29 on, the steps of all slides are skipped. Each time the
// probe has closed and the nozzle rests, its place is a point of the bed (bed_map.h). When all
// points are known and the nozzle rests where the file goes on, the comparison does, too. The path
// behind it follows the bed that was found, and is cut into pieces as a curve is.
//
// Filters. Input shaping and pressure advance (compensation.h) take X, Y and the filament off the
// asked path by a bounded amount, the reach, which is 0 at rest. One motor then no longer tells the
// place on the path: at a corner X is behind and Y ahead, and in a narrow zigzag a belt of CoreXY
// turns back long before the asked corner. So crossings are not followed. What holds is that the
// plan is always within the reach of where the slides stand:
//
//         cursor ●━━━━━━━╮ plan        The cursor stays while the slides are within its reach.
//                 ╲      ┃ ◎           When they are not, it goes on to the first place that is.
//            reach ╲ built             The plan is such a place. So the cursor is never ahead of
//                   ╲  ·               the plan, and follows it at most so far behind.
//
// On its way the cursor passes no place that is kPassBalls times as far: there the slides cannot
// have been. From the cursor on, as long as the slides come nearer: that place is compared and
// shown. The deviation of a shaped motion is its distance from the nearest piece around the cursor,
// and the tolerances grow by the reach. Whether the filament is really pushed ahead is looked at
// apart (advance_watch.h).
//
// Excursions: a person pauses the print; the head leaves the path and comes back. The inspector
// recognises this from the pins:
//
//   built  path ─────●  (rest)  ~~~ steps off the path, rests ~~~  (rest)  ●───── path
//                    P  kRest                                            P: same steps of X Y Z
//
// At every rest on the path the comparison is remembered. Then steps may follow that the path does
// not ask for. If a later rest finds X, Y and Z back at exactly the steps of P, the comparison goes
// on from what was remembered: the steps in between do not count, and E counts on from where it
// left. One step beside P is not P: then all steps are compared, and differ. The number of
// excursions is a finding. judge() compares it with the number that the machine reports, so a
// detour that the machine hides is still a difference.
//
// Just before a G28 an excursion is told from the homing by its first step: that leads a slide from
// its open switch. Where the switches are closed, between two G28 without a move, it begins as the
// homing does. It gives itself away when a slide moves that has been homed already, or is not to
// be: no homing goes on before all of its slides are home. Then the head is away since the rest
// before, and the G28 is still to come. (An excursion that opens every switch and comes back looks
// like a homing from its begin to its end; then the homing itself is the excursion. The places
// agree either way.)
//
// Invariants: s never goes back, except to P; memory is bounded by the look-ahead (kLookAhead
// items) and one read buffer.
//
// It has more functions and members than other classes: the comparison, homing and excursions share
// one place on the path and one set of counts, and an excursion puts all of them back at once. What
// concerns curves is in inspector_curve.cpp, what concerns filters in inspector_shaped.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>

#include "base/time.h"
#include "twin/advance_watch.h"
#include "twin/asked_path.h"
#include "twin/bed_map.h"
#include "twin/byte_source.h"
#include "twin/gantry.h"
#include "twin/homing_watch.h"
#include "twin/machine.h"
#include "twin/observer.h"
#include "twin/turn.h"

namespace qduino::twin {

/// Where the machine is when a job begins, as far as that is known.
struct InspectionStart {
    /// The coordinate that the firmware gives to the place.
    Position asked_mm{};
    /// Microsteps, as the twin counts them, at that place.
    std::array<std::int64_t, kAxisCount> built{};
    /// Built microsteps at coordinate 0; may be fractional.
    std::array<double, kAxisCount> origin{};
    std::array<bool, kSlideCount> pressed{};  ///< switches
    AskedBed bed{};                           ///< as it is behind the job before
    std::map<int, BedMap> maps{};             ///< the beds that were measured

    /// Power-on: the firmware takes its present position as home.
    static InspectionStart at_power_on(const Machine& machine, const Counts& built,
                                       const std::array<bool, kSlideCount>& pressed);
};

/// The movements of one motor during a job, and the final place and homing of the axis of its
/// number. Deviations and positions in mm.
struct AxisFindings {
    std::uint64_t steps = 0;            ///< microsteps moved, either way, homing included
    std::uint64_t unexplained = 0;      ///< steps that the path does not ask for
    double path_deviation_mm_max = 0;   ///< from the straight pieces
    std::uint64_t worst_line = 0;       ///< line of the G-code at the largest deviation
    double curve_deviation_mm_max = 0;  ///< from the arcs and splines
    std::uint64_t worst_curve_line = 0;
    double final_asked_mm = 0;
    double final_built_mm = 0;
    bool final_exact = false;  ///< the motor is at the whole step nearest to asked
    double reach_mm = 0;       ///< what the filters that were asked for may add to the deviations
    double turn_mm = 0;        ///< what the motor may lag behind where it turns back (turn.h)
    bool homed = false;
    /// Distance from where homing stopped to where the switch truly closes (set by Job).
    double homing_error_mm = 0;
};

struct Findings {
    bool path_consumed = false;  ///< every asked piece was passed
    std::array<AxisFindings, kAxisCount> axes{};
    double filament_asked_mm = 0;  ///< net: retractions and their returns cancel
    double filament_built_mm = 0;
    double filament_asked_pushed_mm = 0;  ///< forward movements alone
    double filament_built_pushed_mm = 0;
    /// The share that was built of the lead that pressure advance asks for; over so many
    /// stretches.
    double advance_gain = 1;
    std::uint64_t advance_stretches = 0;
    std::uint64_t line = 0;  ///< line that was reached
    /// How often the head left the path at a rest and came back to the same step.
    std::uint64_t excursions = 0;
    bool away = false;            ///< it left the path for good …
    std::uint64_t left_line = 0;  ///< … at this line of the G-code
    /// … and at the rest nearest to where it left, it stood this many microsteps beside (0 0 0: it
    /// never came near)
    std::array<std::int64_t, kSlideCount> beside_steps{};
};

class Inspector {
  public:
    static constexpr double kAstraySteps = 2.0;
    /// So much of it is for what a motor leaves out where it turns back; more widens the limit.
    static constexpr double kTurnSteps = 1.0;
    /// E further behind than this waits for a step that was left out.
    static constexpr double kWaitingSteps = 3.0;
    static constexpr std::size_t kLookAhead = 4096;
    /// Below a tie: where a carriage turns back, the chord may miss a crossing by so much.
    static constexpr double kChordSteps = 0.005;
    /// The longest piece of a way over the measured bed.
    static constexpr double kBedPieceMm = 0.5;
    /// After this many unexplained steps in a row the comparison gives up and only counts.
    static constexpr std::uint64_t kGiveUp = 20'000;
    /// Nothing moved for this long: a rest. The machine rests longer on both ends of an excursion.
    static constexpr Nanoseconds kRest{40'000'000};
    /// Rests that are remembered.
    static constexpr std::size_t kRests = 4;
    /// After this many unexplained steps in a row, or this far off with E alone, the head is away:
    /// the inspector stops looking for its place on the path.
    static constexpr std::uint64_t kAwaySteps = 64;
    /// So far behind a rest nobody leaves the path: what goes wrong there is the machine's own
    /// error, and is followed.
    static constexpr std::uint64_t kAwayWithinSteps = 2000;
    /// On top of the steps above: a firmware's chord may be so far from the true curve.
    static constexpr double kChordMm = 0.006;
    /// With a shaper, in reaches: since the cursor came where it is, the slides went at most two
    /// reaches, and the plan was at most one from them; so 3.
    static constexpr double kPassBalls = 3;
    /// … its distance is looked for among so many pieces on each side.
    static constexpr std::size_t kAround = 24;
    /// A place that is no further off than this and a chord needs no look behind the curve.
    static constexpr double kOnCurveSteps = 0.75;
    /// This near to what was asked, the head is on the path; E by its tolerance.
    static constexpr double kCleanSteps = 1.0;
    static constexpr double kCleanExtruderSteps = 5.0;
    /// A rest nearer than this to the place where it left is worth reporting.
    static constexpr std::int64_t kNearSteps = 400;

    /// `source` must outlive the inspector.
    Inspector(const Machine& machine, ByteSource& source, const InspectionStart& start);

    void on_step(const StepSeen& step);
    void on_endstop(Instant at, int axis, bool pressed);
    void on_probe(Instant at);
    /// A line that was typed beside the job, and that changes what is asked from then on
    /// (AskedLines::insert).
    void on_typed(std::uint64_t behind_line, std::string_view line, double left_mm = 0);

    /// Call when everything that will be built is built: passes the rest of the path, and sums up.
    /// A job that was cut short is compared with all that the file asks when `read_rest` is set
    /// (which takes as long as reading it does), else with what was read until then.
    [[nodiscard]] Findings finish(Instant now, bool read_rest = true);
    /// The start of the next job of the same session: the place that was asked last, and where its
    /// zero lies. After finish().
    [[nodiscard]] InspectionStart next_start() const;
    /// Steps of each slide at which it came to rest on its switch, where it was homed.
    [[nodiscard]] const std::array<std::int64_t, kSlideCount>& homed_at() const { return homed_at_; }
    /// Slides that look for their switches now, as a mask.
    [[nodiscard]] std::uint8_t homing() const { return homing_.pending(); }
    [[nodiscard]] std::uint64_t line() const { return pieces_[place_].line; }
    /// The head has left the path: filament pushed now is no part of the print.
    [[nodiscard]] bool away() const { return away_; }
    /// The place on the path is known: no axis is being homed, and the head is not away.
    [[nodiscard]] bool on_path() const { return !away_ && !homing_.active(); }
    /// That place, in microsteps from coordinate 0; between two steps it may be fractional.
    [[nodiscard]] const std::array<double, kAxisCount>& asked_steps() const { return so_far_.at; }
    [[nodiscard]] bool on_curve() const { return pieces_[place_].curved; }
    /// How much of the height of a nozzle there, in mm, follows the bed that was measured. What is
    /// left is the height that the file asks for.
    [[nodiscard]] double lift_by_bed(const Position& nozzle) const;
    /// Microsteps that E moved on excursions, all together.
    [[nodiscard]] std::int64_t pushed_away() const { return pushed_away_; }

  private:
    using Point = std::array<double, kAxisCount>;  // microsteps from coordinate 0
    struct Piece {
        AskedItem::Kind kind = AskedItem::Kind::end;
        std::uint8_t homed = 0;
        bool curved = false;
        std::uint64_t line = 0;
        Point from{};
        Point to{};
        double advance_s = 0;
        int map = 0;  ///< of the bed that is followed; 0: none
        double fade_end_mm = 0;
    };
    /// A place on the path: piece and share of it. `at` is asked(s).
    struct Cursor {
        std::size_t piece = 0;
        double share = 0;
        Point at{};
        Point worst{};        // largest deviations met on the way here
        bool curved = false;  // the way here touched a curve
    };
    struct Step {
        std::size_t axis = 0;
        double direction = 1;
        double boundary = 0;
        double limit_steps = 0;  // how far another axis may be left behind
    };

    /// The state of the comparison; coming back from an excursion restores it.
    struct Comparison {
        double share = 0;            ///< of pieces_[0]: the cursor
        Point at{};                  ///< asked there
        Point built{};               ///< whole steps relative to origin_
        std::int64_t net_steps = 0;  ///< of the extruder
        std::uint64_t pushed_steps = 0;
        std::uint64_t unexplained_run = 0;
        Point worst{};         ///< from straight pieces
        Point worst_curved{};  ///< from curves
        Findings findings{};
    };
    /// The comparison as it stood at a rest on the path.
    struct Remembered {
        Comparison so_far;
        std::deque<Piece> pieces;
        std::array<std::int64_t, kAxisCount> position{};
        std::uint64_t pieces_read = 0;
    };

    /// The largest deviation of E until the cursor came to a line.
    struct WorstExtruder {
        std::uint64_t line = 0;
        double steps = 0;
    };

    /// A G29 in hand.
    struct Probing {
        bool active = false;
        bool touches = false;  ///< the probe has closed, and the nozzle has not risen since
        int map = 0;
    };

    void rest();
    void remember();
    void come_back(std::size_t which);
    void take_leave();
    void forget_oldest();
    void note_near_miss();
    void goes_on();
    [[nodiscard]] bool is_clean_since(const Remembered& then) const;
    [[nodiscard]] bool is_on_path() const;
    [[nodiscard]] bool stands_at(const Remembered& then) const;
    [[nodiscard]] bool stands_at_but_for(const Remembered& then, const Step& step) const;
    [[nodiscard]] bool leaves(std::size_t axis) const;
    void follow(std::size_t axis, int direction);
    [[nodiscard]] bool advance_in_piece(const Step& step);
    [[nodiscard]] bool walk(const Step& step);
    [[nodiscard]] bool goes_from_open_switch(const Step& step) const;
    [[nodiscard]] bool begins_homing(Cursor& cursor, const Step& step);
    [[nodiscard]] bool project(Cursor& cursor);
    [[nodiscard]] double nearest_share(const Piece& here, double from) const;
    [[nodiscard]] bool is_near_curve(const Cursor& cursor, double limit_steps) const;
    void commit_on_curve(const Cursor& cursor);
    [[nodiscard]] double coarser_steps(std::size_t axis, const Piece& here) const;
    void drop_passed(const Cursor& cursor);
    void follow_extruder(int direction);
    [[nodiscard]] double slides_reach(const Cursor& cursor, bool behind);
    [[nodiscard]] static Point point_on(const Piece& piece, double share);
    [[nodiscard]] bool creep(Cursor& cursor, const Step& step) const;
    [[nodiscard]] bool pass_end(Cursor& cursor, const Step& step) const;
    [[nodiscard]] bool others_near(const Cursor& cursor, const Step& step) const;
    [[nodiscard]] bool pass_rest();
    void commit(const Cursor& cursor);
    void note(std::size_t axis, double deviation_steps, bool curved);
    void note_all(bool curved);
    void begin_homing();
    [[nodiscard]] bool begins_probing(Cursor& cursor, const Step& step);
    void probe_step(Instant at);
    [[nodiscard]] bool has_probed(Instant at) const;
    void end_probing();
    void end_homing(std::uint8_t homed);
    void take_for_excursion();
    [[nodiscard]] const Piece& piece(std::size_t index);
    void read_item();
    void push_way(const AskedItem& item);
    void push_piece(const Piece& piece);
    [[nodiscard]] Position corrected(const Position& asked, const AskedCorrection& by) const;
    [[nodiscard]] double fade_at(double asked_z_mm, double fade_end_mm) const;
    [[nodiscard]] Position home_from(const AskedItem& item) const;
    [[nodiscard]] Point place_at_start(const InspectionStart& start) const;
    [[nodiscard]] Point to_steps(const Position& mm) const;
    [[nodiscard]] Position to_mm(const Point& steps) const;
    [[nodiscard]] Position built_mm() const;
    void widen_reach();
    void widen_turn(const Position& nozzle);
    [[nodiscard]] double slack_steps(std::size_t axis) const;
    [[nodiscard]] bool turns_back(std::size_t axis, std::size_t index, double edge, double way);
    [[nodiscard]] Point off_nearest_piece();
    [[nodiscard]] bool shaped() const { return reach_steps_[0] > 0; }
    [[nodiscard]] static bool moves_slides(const Piece& piece);
    [[nodiscard]] bool filament_leads(const Piece& piece) const;
    [[nodiscard]] bool filament_is_past(const Piece& piece) const;
    [[nodiscard]] static bool is_at_end(const Piece& piece, double share);
    [[nodiscard]] double ball_steps(std::size_t axis) const;
    [[nodiscard]] double beside(const Point& at) const;
    [[nodiscard]] bool first_within(Cursor& cursor, double balls) const;
    [[nodiscard]] bool find_within(Cursor& cursor, double balls);
    void follow_shaped(const Step& step);
    [[nodiscard]] bool begins_at_rest(Cursor& cursor, const Step& step);
    void follow_extruder_shaped(int direction);
    void show_place();
    void rest_shaped();
    void watch_advance(int direction);
    [[nodiscard]] std::size_t stretch(std::deque<Piece>& pieces, AskedPath::Stretch by,
                                      Comparison& cursor) const;
    [[nodiscard]] double worst_extruder_before(std::uint64_t line) const;
    void note_worst_extruder();

    Machine machine_;
    Gantry gantry_;
    AskedPath asked_;
    std::map<int, BedMap> maps_;
    Probing probing_;
    int last_map_ = 0;
    Position read_to_;          // the end of what has been read of it
    double chord_error_mm_;     // kChordSteps of the finest motor
    double early_steps_;        // a step takes the cursor so far before its boundary
    std::deque<Piece> pieces_;  // [0] holds the cursor
    Comparison so_far_;
    std::array<double, kAxisCount> origin_{};
    std::array<std::int64_t, kAxisCount> position_{};  // as the twin counts
    std::array<bool, kSlideCount> pressed_{};
    Instant now_{};
    HomingWatch homing_;
    std::array<std::int64_t, kSlideCount> homed_at_{};
    /// The origin at the rest in remembered_ that a homing began at, which may be an excursion.
    std::optional<std::array<double, kAxisCount>> origin_at_rest_;
    // The newest last. More than one, because a way that begins along the path looks like the path.
    std::deque<Remembered> remembered_;
    std::deque<Piece> read_since_;  // pieces read since the oldest of them
    std::uint64_t pieces_read_ = 0;
    std::int64_t pushed_away_ = 0;
    std::uint64_t since_rest_ = 0;  // steps of X and Y: a lift may be the path's and the way's
    Reach reach_mm_{};              // of all filters that were asked for so far
    Point reach_steps_{};
    std::array<double, kSlideCount> plan_steps_{};  // how far from the plan filters take a motor
    Position turn_mm_{};                            // the largest of the motors on the way so far
    std::uint64_t filters_seen_ = 0;
    std::deque<Piece> passed_;  // the last kAround, of a shaped motion
    std::size_t place_ = 0;     // so_far_.at is on this piece; of a shaped motion beyond [0]
    AdvanceWatch advance_;
    bool away_ = false;
    bool counted_ = true;  // the excursion that was come back from last
    Position final_asked_{};
    std::deque<WorstExtruder> worst_extruder_;  // of the last lines
};

}  // namespace qduino::twin
