// The printer's own estimate: how long a job will take on this machine, before it is printed.
//
// A slicer's estimate is that of another firmware: it knows neither this planner's corners, nor
// this machine's homing and heaters. So the job is planned here as it will be printed, and no
// step is made:
//
//   Preflight ─► moves, dwells ─► Planner ─► segments and their durations ─┐
//            ├─► homing ───────► Homing's orders, on the same trapezoids ──┼─► time, by activity,
//            └─► temperatures ─► HeatForecast: control on a model ─────────┘   layer and byte
//
// - The limits, M201 to M205 too, and the corners are those of the machine: the same Planner.
// - Where the motors must stand, the machine's own filters run out first (step/path_solver.h).
// - A wait for heat is loop 3's own control on a model of the heaters (heat_forecast.h).
// - Loop 1 decides at its releases, every 100 ms. Where it waits for the motion's end (homing, a
//   wait for heat), the time runs on to the next release.
// - Where an axis stands before its first homing nobody can know: a hand may have moved it. It is
//   expected where the machine file says (expected_from_switch_mm), and what that leaves open is
//   told: less_s and more_s, for a homing that ends well. From then on its place is known.
// - The heaters are expected to be cold, and nobody to be waited for: a pause (M0, M600) takes no
//   time.
//
// Sans I/O. The planner is about 150 KB; beside it, four bytes for each layer. Give it the heap.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "printer/estimate/heat_forecast.h"
#include "printer/estimate/time_profile.h"
#include "printer/gcode/annotation.h"
#include "printer/machine/homing.h"
#include "printer/machine/limits.h"
#include "printer/machine/motion_pipe.h"
#include "printer/machine/printed_top.h"
#include "printer/motion/planner.h"
#include "printer/preflight/move_sink.h"
#include "printer/probe_grid.h"

namespace qduino::printer::estimate {

/// What the machine does: one of the slicer's features, by its number, or one of these.
enum class Activity : std::uint8_t {
    travel = gcode::kFeatureCount,
    retraction,  ///< filament alone moves
    dwell,
    homing,   ///< and probing of the bed
    heating,  ///< the job waits for a temperature
};
inline constexpr std::size_t kActivityCount = gcode::kFeatureCount + 5;

constexpr Activity activity_of(gcode::Feature feature) { return static_cast<Activity>(feature); }
/// `outer_wall`, `travel`: the word for it in the HTTP interface and in reports.
[[nodiscard]] std::string_view name_of(Activity activity);

struct Estimate {
    double total_s = 0;
    std::array<double, kActivityCount> activity_s{};  ///< by Activity; together the total
    /// It may take so much less, and so much more: the first approach of each axis to its switch
    /// begins at the switch, or as far away as homing goes.
    double less_s = 0, more_s = 0;
    std::vector<float> layer_s;  ///< moves and dwells of each layer, from 0
    /// Over the time that moves, dwells and homing take: without the waits for heat.
    TimeProfile profile;
    /// All that has been done of the file when the last wait for heat begins.
    std::uint64_t heated_byte = 0;

    [[nodiscard]] double heating_s() const { return activity_s[static_cast<std::size_t>(Activity::heating)]; }
};

class Estimator final : public preflight::MoveSink {
  public:
    explicit Estimator(const MachineConfig& machine);
    Estimator(const Estimator&) = delete;
    Estimator& operator=(const Estimator&) = delete;

    /// Whole from on_end() on.
    [[nodiscard]] const Estimate& estimate() const { return estimate_; }

    void on_move(const gcode::Move& move, const preflight::MoveContext& context) override;
    void on_dwell(Seconds duration) override;
    void on_home(gcode::AxisSet axes) override;
    void on_probe() override;
    void on_temperature(gcode::Heater heater, Celsius target, std::optional<gcode::WaitFor> wait) override;
    void on_limits(const gcode::LimitChange& change) override;
    void on_pause() override { come_to_rest(); }
    void on_motors_off(gcode::AxisSet unhomed) override;
    void on_end(std::uint64_t bytes) override;

  private:
    /// What a segment that the planner will hand out is for.
    struct Purpose {
        Activity activity = Activity::travel;
        gcode::Heater heater = gcode::Heater::hot_end;
        std::uint32_t layer = 0;
        Celsius target{};  ///< of a marker: from there on
        std::uint64_t end_offset = 0;
    };

    /// How long before the plan a filtered motion begins, and how long behind it it ends.
    struct FilterTimes {
        double before_s = 0, behind_s = 0;
    };
    [[nodiscard]] static FilterTimes times_of(const motion::MotionSettings& settings);

    /// As the machine does, and for the same room, with the same markers in the queue: where all
    /// moves are short it is the room that bounds their speed.
    void make_room() {
        if (planner_.free() < machine::MotionPipe::kPlannerReserve) take_final();
    }
    void append_marker(std::uint32_t value, Activity activity, gcode::Heater heater = {},
                       Celsius target = {});
    void remember(const Purpose& purpose) { purposes_[appended_++ % purposes_.size()] = purpose; }
    void take_final();
    void take(const motion::Segment& segment);
    void come_to_rest();
    void take_leave();
    void spend(Activity activity, double duration_s);
    void wait_for_release(Activity activity);
    [[nodiscard]] double duration_of(const machine::Homing::Order& order, double from_switch_mm);
    [[nodiscard]] double from_switch_mm(Axis axis) const;
    [[nodiscard]] double way_of_probe(const ProbePlace& place);
    [[nodiscard]] double way_to_bed();

    MachineConfig machine_;
    motion::Planner planner_;
    machine::Accelerations accelerations_;
    HeatForecast heat_;
    Estimate estimate_;
    std::array<Purpose, motion::Planner::kCapacity> purposes_{};  ///< of what is in the planner
    std::uint64_t appended_ = 0;
    std::uint64_t taken_ = 0;
    /// The expected place of an axis, less the believed one; none once the axis has been homed.
    PerAxis<std::optional<double>> expected_mm_{};
    PerAxis<bool> let_go_{};  ///< its motor went off, and it has not been homed since
    machine::PrintedTop printed_;
    std::uint32_t layer_ = 0;
    std::uint64_t end_offset_ = 0;
    FilterTimes filters_{};
    bool moving_ = false;     ///< what has been taken does not end with a standstill
    double cooling_s_ = 0;    ///< time that the heat forecast has not been told of
    double released_s_ = -1;  ///< total at the last release that was waited for
};

}  // namespace qduino::printer::estimate
