#include "printer/gcode/handlers.h"

namespace qduino::printer::gcode {
namespace {

constexpr Handlers::Entry kTable[] = {
    {'G', 1, -1, Handlers::linear_move},
    {'G', 0, -1, Handlers::linear_move},
    {'G', 2, -1, Handlers::arc_clockwise},
    {'G', 3, -1, Handlers::arc_counterclockwise},
    {'G', 92, -1, Handlers::set_position},
    {'G', 92, 1, Handlers::machine_coordinates},
    {'G', 4, -1, Handlers::dwell},
    {'G', 10, -1, Handlers::retract},
    {'G', 11, -1, Handlers::recover},
    {'G', 17, -1, Handlers::nothing},
    {'G', 20, -1, Handlers::inches},
    {'G', 21, -1, Handlers::millimetres},
    {'G', 28, -1, Handlers::home},
    {'G', 90, -1, Handlers::absolute},
    {'G', 91, -1, Handlers::relative},
    {'M', 0, -1, Handlers::stop},
    {'M', 1, -1, Handlers::stop},
    {'M', 18, -1, Handlers::motors_off},
    {'M', 73, -1, Handlers::progress},
    {'M', 82, -1, Handlers::absolute_extrusion},
    {'M', 83, -1, Handlers::relative_extrusion},
    {'M', 84, -1, Handlers::motors_off},
    {'M', 104, -1, Handlers::hot_end},
    {'M', 105, -1, Handlers::report_temperatures},
    {'M', 106, -1, Handlers::fan_on},
    {'M', 107, -1, Handlers::fan_off},
    {'M', 109, -1, Handlers::hot_end_wait},
    {'M', 110, -1, Handlers::nothing},  // the host session (host_session.h) has taken it
    {'M', 112, -1, Handlers::emergency_stop},
    {'M', 114, -1, Handlers::report_position},
    {'M', 115, -1, Handlers::report_firmware},
    {'M', 117, -1, Handlers::message},
    {'M', 118, -1, Handlers::echo},
    {'M', 140, -1, Handlers::bed},
    {'M', 190, -1, Handlers::bed_wait},
    {'M', 201, -1, Handlers::axis_accelerations},
    {'M', 203, -1, Handlers::axis_speeds},
    {'M', 204, -1, Handlers::accelerations},
    {'M', 205, -1, Handlers::instantaneous_speeds},
    {'M', 207, -1, Handlers::retraction_settings},
    {'M', 208, -1, Handlers::recover_settings},
    {'M', 220, -1, Handlers::speed_factor},
    {'M', 221, -1, Handlers::flow_factor},
    {'M', 400, -1, Handlers::wait_for_moves},
    {'M', 600, -1, Handlers::filament_change},
    {'M', 601, -1, Handlers::pause},
    {'T', 0, -1, Handlers::tool},
};

}  // namespace

std::span<const Handlers::Entry> Handlers::table() { return kTable; }

Handlers::Handler Handlers::find(const CodeInfo& code) {
    for (const Entry& entry : kTable) {
        if (entry.letter == code.letter && entry.number == code.number && entry.subcode == code.subcode) {
            return entry.handler;
        }
    }
    return nullptr;
}

Result<std::optional<double>> Handlers::number(const Command& command, char letter) {
    const auto value = command.parameters.value(letter);
    if (!value && command.parameters.has(letter)) {
        FixedString<64> text;
        text.push_back(letter).append(" needs a number behind it");
        return make_error(ErrorCode::invalid_argument, text);
    }
    return value;
}

Result<std::optional<double>> Handlers::number_within(const Command& command, char letter, double low,
                                                      double high, std::string_view unit) {
    auto value = number(command, letter);
    if (value && *value && !(**value >= low && **value <= high))
        return outside(letter, **value, low, high, unit);
    return value;
}

Error Handlers::outside(char letter, double value, double low, double high, std::string_view unit) {
    FixedString<236> text;
    text.push_back(letter);
    append_shortest(text, value).append(" is outside of ");
    append_shortest(text, low).append(" to ");
    append_shortest(text, high).push_back(' ').append(unit);
    return make_error(ErrorCode::out_of_range, text);
}

}  // namespace qduino::printer::gcode
