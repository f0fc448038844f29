#include "printer/preflight/prologue.h"

#include <algorithm>

#include "base/text.h"
#include "printer/axis_reach.h"

namespace qduino::printer::preflight {
namespace {

/// A line of filament along the front edge, which leaves the nozzle full.
constexpr double kFromEdge_mm = 2, kPrimeFrom_mm = 10, kPrimeLength_mm = 60, kPrimeHeight_mm = 0.3;

std::string default_start(const MachineConfig& machine) {
    std::string lines;
    if (machine.has_bed) lines += "M140 S{BED}\n";
    lines += "G28\n";
    if (machine.has_bed) lines += "M190 S{BED}\n";
    lines += "M109 S{HOT_END}\n";
    // A delta's bed is round: a line along its front edge would be in the air.
    if (machine.kinematics.type == KinematicsType::delta) return lines;
    // A file of such a job may home once more.
    const Reach x = before_the_switch(machine.axes[Axis::x]), y = before_the_switch(machine.axes[Axis::y]);
    const double from_mm = std::min(x.from.value() + kPrimeFrom_mm, x.to.value());
    const double to_mm = std::min(from_mm + kPrimeLength_mm, x.to.value());
    const double y_mm = std::min(y.from.value() + kFromEdge_mm, y.to.value());
    const double filament_mm = (to_mm - from_mm) * kPrimeHeight_mm * machine.nozzle_diameter.value() * 1.5 /
                               filament_area_mm2(machine);
    write(lines, "G1 Z5 F600\nG1 X", Shortest{from_mm}, " Y", Shortest{y_mm}, " F3000\nG1 Z",
          Shortest{kPrimeHeight_mm}, " F600\nG1 X", Shortest{to_mm}, " E", Fixed{filament_mm, 3},
          " F900\nG92 E0\nG1 Z5 F600\n");
    return lines;
}

void fill_in(std::string& lines, std::string_view name, Celsius value) {
    for (std::size_t at = lines.find(name); at != std::string::npos; at = lines.find(name, at))
        lines.replace(at, name.size(), text<std::string>(Shortest{value.value()}));
}

}  // namespace

std::string prologue_of(const MachineConfig& machine, const Facts& facts) {
    std::string lines{machine.start.text.view()};
    if (lines.empty()) lines = default_start(machine);
    const Metadata& said = facts.metadata;
    const Celsius hot_end = std::clamp(said.hot_end.value_or(machine.start.hot_end), machine.minimum_extrude,
                                       highest_target(machine.hot_end));
    const Celsius bed =
        std::clamp(said.bed.value_or(machine.start.bed), Celsius{0}, highest_target(machine.bed));
    fill_in(lines, "{HOT_END}", hot_end);
    fill_in(lines, "{BED}", bed);
    if (lines.back() != '\n') lines += '\n';
    return lines;
}

}  // namespace qduino::printer::preflight
