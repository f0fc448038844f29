#include "twin/fault.h"

#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "twin/machine.h"

namespace qduino::twin {
namespace {

enum class Where : std::uint8_t { nowhere, heater, slide, motor };

struct KindRow {
    std::string_view name;
    FaultKind kind;
    Where where;
};
constexpr std::array<KindRow, 9> kKinds{{
    {"sensor_stuck", FaultKind::sensor_stuck, Where::heater},
    {"sensor_open", FaultKind::sensor_open, Where::heater},
    {"sensor_short", FaultKind::sensor_short, Where::heater},
    {"heater_disconnected", FaultKind::heater_disconnected, Where::heater},
    {"heater_stuck_on", FaultKind::heater_stuck_on, Where::heater},
    {"bus_silent", FaultKind::bus_silent, Where::nowhere},
    {"endstop_stuck_closed", FaultKind::endstop_stuck_closed, Where::slide},
    {"endstop_stuck_open", FaultKind::endstop_stuck_open, Where::slide},
    {"motor_disconnected", FaultKind::motor_disconnected, Where::motor},
}};

Error refusal(std::string_view what, std::string_view text) {
    Error error{ErrorCode::invalid_argument, "fault '"};
    error.message.append(text).append("': ").append(what);
    return error;
}

std::optional<std::uint8_t> axis_number(std::string_view name, int count) {
    for (int axis = 0; axis < count; ++axis)
        if (name.size() == 1 && (name[0] | 0x20) == (kAxisLetter[static_cast<std::size_t>(axis)] | 0x20))
            return static_cast<std::uint8_t>(axis);
    return std::nullopt;
}

std::optional<std::uint8_t> place_number(Where where, std::string_view name) {
    switch (where) {
        case Where::nowhere:
            return name.empty() ? std::optional<std::uint8_t>{0} : std::nullopt;
        case Where::heater:
            if (name.empty() || name == "hot_end") return static_cast<std::uint8_t>(kHotEnd);
            if (name == "bed") return static_cast<std::uint8_t>(kBed);
            return std::nullopt;
        case Where::slide:
            return axis_number(name, kSlideCount);
        case Where::motor:
            return axis_number(name, kAxisCount);
    }
    return std::nullopt;
}

}  // namespace

std::string_view name_of(FaultKind kind) {
    for (const KindRow& row : kKinds)
        if (row.kind == kind) return row.name;
    return "unknown";
}

Result<Fault> parse_fault(std::string_view text) {
    std::string_view rest = text;
    Fault fault;
    if (const auto at = rest.find('@'); at != std::string_view::npos) {
        const std::string_view digits = rest.substr(at + 1);
        double seconds = 0;
        const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), seconds);
        if (error != std::errc{} || end != digits.data() + digits.size() || !(seconds >= 0) || seconds > 1e9)
            return refusal("after @ comes a time in seconds, 0 or more", text);
        fault.at = kEpoch + from_seconds(seconds);
        rest = rest.substr(0, at);
    }
    const auto colon = rest.find(':');
    const std::string_view kind = rest.substr(0, colon);
    const std::string_view place =
        colon == std::string_view::npos ? std::string_view{} : rest.substr(colon + 1);
    for (const KindRow& row : kKinds) {
        if (row.name != kind) continue;
        const std::optional<std::uint8_t> which = place_number(row.where, place);
        if (!which) return refusal("the place is hot_end or bed for heat, x y z (e) for axes", text);
        fault.kind = row.kind;
        fault.which = *which;
        return fault;
    }
    return refusal(
        "known are sensor_stuck, sensor_open, sensor_short, heater_disconnected, heater_stuck_on, "
        "bus_silent, "
        "endstop_stuck_closed, endstop_stuck_open, motor_disconnected",
        text);
}

}  // namespace qduino::twin
