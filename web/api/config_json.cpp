#include "web/api/config_json.h"

#include <nlohmann/json.hpp>

namespace qduino::web::api {

std::string config_json(const printer::MachineConfig& machine, std::string_view version) {
    nlohmann::ordered_json axes;
    for (std::size_t i = 0; i < 4; ++i) {
        const printer::AxisConfig& axis = machine.axes[i];
        nlohmann::ordered_json& json = axes[std::string(1, "xyze"[i])];
        json = {{"steps_per_mm", axis.steps_per_mm},
                {"max_speed_mm_s", axis.max_speed.value()},
                {"max_acceleration_mm_s2", axis.max_acceleration.value()}};
        if (i == 3) continue;
        json["min_mm"] = axis.minimum.value();
        json["max_mm"] = axis.maximum.value();
    }
    const nlohmann::ordered_json json{
        {"name", std::string{machine.name.view()}},
        {"version", version},
        {"axes", axes},
        {"hot_end",
         {{"max_c", highest_target(machine.hot_end).value()},
          {"min_extrude_c", machine.minimum_extrude.value()}}},
        {"bed", {{"present", machine.has_bed}, {"max_c", highest_target(machine.bed).value()}}},
        {"nozzle_mm", machine.nozzle_diameter.value()},
        {"filament_mm", machine.filament_diameter.value()}};
    return json.dump();
}

}  // namespace qduino::web::api
