// The report on one job: what was asked, what was built, whether the two are the same, and what the
// machine lost or broke.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "twin/axis_drive.h"
#include "twin/deposit.h"
#include "twin/findings.h"
#include "twin/racking.h"

namespace qduino::twin {

/// How far built may be from asked. A perfect machine stands half a microstep from its path at
/// most, and lags where a motor turns back (turn.h).
struct Tolerances {
    static constexpr double kHalfStep = 0.5;
    /// Two belts that were homed along one axis may both stand half a step off: where the switch
    /// is, their sum is a whole number, and one of them need not be.
    static constexpr double kBeltSteps = 0.5;
    /// Never less, for the order in which near-simultaneous steps were sent.
    static constexpr double kSlideSteps = 1.0;
    /// For filament: where two moves meet, E may take its steps a little before the slides, or
    /// behind.
    static constexpr double kExtruderSteps = 5.0;
    static constexpr double kExtruderMm = 0.052;
    /// From a true curve the firmware's own chords may be this far, on top of so many microsteps.
    static constexpr double kCurveMm = 0.006;
    static constexpr double kCurveSteps = 0.75;
    /// The largest error of the lead that pressure advance asks for, as a share of it.
    static constexpr double kAdvanceShare = 0.25;

    /// Two motors that move one slide: their pulses come one after the other.
    static constexpr std::int64_t kRackingSteps = 1;
    static constexpr std::int64_t kOffSwitchSteps = 2;

    std::array<double, kAxisCount> path_mm{};
    std::array<double, kAxisCount> curve_mm{};
    double filament_share = 0.0005;  ///< of the filament asked; never less than one microstep
};
/// From the microsteps of the machine's own axes, and from what was asked of them.
[[nodiscard]] Tolerances tolerances_of(const Machine& machine, const Findings& found);

struct TemperatureRange {
    double minimum_celsius = 0;
    double maximum_celsius = 0;
};

struct Report {
    bool completed = false;  ///< the path was passed to its end
    bool matches = false;    ///< completed, and no entry in `differences`
    /// Each names an axis or a quantity, asked, built and the tolerance.
    std::vector<std::string> differences;
    Findings findings;
    /// How often the machine reports that it left the path and came back.
    std::uint64_t excursions_told = 0;
    std::array<std::uint64_t, kAxisCount> lost_steps{};  ///< during this job, whatever the reason
    std::array<AxisCounters, kAxisCount> counters{};     ///< during this job
    std::vector<Racking> racking;                        ///< per extra motor of the machine
    std::uint64_t timing_violations = 0;
    std::uint64_t cold_extrusion_steps = 0;  ///< filament pushed into a nozzle too cold to melt it
    bool extruded = false;
    TemperatureRange hot_end;  ///< while extruding
    TemperatureRange bed;
    double duration_s = 0;
    double volume_mm3 = 0;
    std::uint64_t layers_merged = 0;
    std::vector<Layer> layers;
};

/// Fills `completed`, `matches` and `differences` from the rest of `report` on `machine`. An
/// excursion that came back to the step is no difference, provided that the machine reports it.
void judge(Report& report, const Machine& machine);

/// The report as one JSON object (keys as in docs/twin.md); at most `layer_limit` layers are
/// listed.
[[nodiscard]] std::string to_json(const Report& report, std::size_t layer_limit = 2000);

}  // namespace qduino::twin
