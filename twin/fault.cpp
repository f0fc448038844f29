#include "twin/fault.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <span>

#include "twin/machine.h"

namespace qduino::twin {
namespace {

enum class Where : std::uint8_t { nowhere, heater, slide, motor };

struct KindRow {
    std::string_view name;
    FaultKind kind;
    Where where;
};
constexpr std::array<KindRow, 11> kKinds{{
    {"sensor_stuck", FaultKind::sensor_stuck, Where::heater},
    {"sensor_drifts", FaultKind::sensor_drifts, Where::heater},
    {"sensor_open", FaultKind::sensor_open, Where::heater},
    {"sensor_short", FaultKind::sensor_short, Where::heater},
    {"heater_disconnected", FaultKind::heater_disconnected, Where::heater},
    {"heater_stuck_on", FaultKind::heater_stuck_on, Where::heater},
    {"fan_dead", FaultKind::fan_dead, Where::nowhere},
    {"bus_silent", FaultKind::bus_silent, Where::nowhere},
    {"endstop_stuck_closed", FaultKind::endstop_stuck_closed, Where::slide},
    {"endstop_stuck_open", FaultKind::endstop_stuck_open, Where::slide},
    {"motor_disconnected", FaultKind::motor_disconnected, Where::motor},
}};

Error refusal(std::string_view what, std::string_view text) {
    return make_error(ErrorCode::invalid_argument, "fault '", text, "': ", what);
}

/// The place of `name` among `known`.
std::optional<std::uint8_t> number_of(std::string_view name, std::span<const std::string_view> known) {
    const auto found = std::ranges::find(known, name);
    if (found == known.end()) return std::nullopt;
    return static_cast<std::uint8_t>(found - known.begin());
}

std::optional<std::uint8_t> place_number(Where where, std::string_view name) {
    constexpr std::string_view kHeaters[]{"hot_end", "bed"};
    constexpr std::string_view kAxes[]{"x", "y", "z", "e"};
    const char small[]{name.size() == 1 ? static_cast<char>(name[0] | 0x20) : '\0'};
    switch (where) {
        case Where::nowhere:
            return name.empty() ? std::optional<std::uint8_t>{0} : std::nullopt;
        case Where::heater:
            return name.empty() ? std::uint8_t{kHotEnd} : number_of(name, kHeaters);
        case Where::slide:
            return number_of({small, 1}, std::span{kAxes}.first(kSlideCount));
        case Where::motor:
            return number_of({small, 1}, kAxes);
    }
    return std::nullopt;
}

}  // namespace

std::string_view name_of(FaultKind kind) {
    const auto* row = std::ranges::find(kKinds, kind, &KindRow::kind);
    return row != kKinds.end() ? row->name : "unknown";
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
    const auto* row = std::ranges::find(kKinds, kind, &KindRow::name);
    if (row == kKinds.end()) {
        Error unknown = refusal("known are", text);
        for (const KindRow& each : kKinds)
            write(unknown.message, &each == kKinds.begin() ? " " : ", ", each.name);
        return unknown;
    }
    const std::optional<std::uint8_t> which = place_number(row->where, place);
    if (!which) return refusal("the place is hot_end or bed for heat, x y z (e) for axes", text);
    fault.kind = row->kind;
    fault.which = *which;
    return fault;
}

}  // namespace qduino::twin
