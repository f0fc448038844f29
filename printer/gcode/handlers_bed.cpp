// The bed as it is, and axes that are not square: G29 G80 M420 M852, BED_MESH_… SET_SKEW.
//
//   G29, G80, BED_MESH_CALIBRATE    measure the bed, and follow it from the next move on
//   M420 S1 Z10                     follow it, and no more from 10 mm on; S0: as if it were flat
//   BED_MESH_PROFILE LOAD=NAME      … SAVE=NAME, REMOVE=NAME;  BED_MESH_CLEAR
//                                   LOAD=default: what was measured last, if no bed has that name
//   M852 I J K, SET_SKEW XY=AC,BD,AD    the tangents, or what a printed square measures
//
// Facts: marlinfw.org/docs/gcode/G029.html, M420.html, M852.html; Klipper's documentation, "Bed
// Mesh" and "Skew correction". A probe's own offsets are the machine file's.
#include <cmath>

#include "printer/gcode/context.h"
#include "printer/gcode/text.h"
#include "printer/gcode/word_parameters.h"
#include "printer/probe_grid.h"

namespace qduino::printer::gcode::handlers {
namespace {

constexpr double kFadeMax_mm = 1000;

/// What a square of printed lines tells: the diagonals AC and BD, and the side AD. Klipper's
/// formula (its module for skew): the other side from the parallelogram's law, then the angle at A.
Result<double> skew_of(std::string_view lengths) {
    double given[3] = {};
    for (double& length : given) {
        const auto value = take_number(lengths);
        if (!value || !(*value > 0))
            return make_error(ErrorCode::invalid_argument, "give AC,BD,AD, three lengths");
        length = *value;
        if (!lengths.empty() && lengths.front() == ',') lengths.remove_prefix(1);
    }
    const double ac = given[0], bd = given[1], ad = given[2];
    const double side = std::sqrt(2 * ac * ac + 2 * bd * bd - 4 * ad * ad) / 2;
    const double cosine = (ac * ac - side * side - ad * ad) / (2 * side * ad);
    const double tangent = cosine / std::sqrt(1 - cosine * cosine);
    if (std::abs(tangent) <= kSkewMax) return tangent;
    return make_error(ErrorCode::out_of_range, "these lengths are of no square");
}

}  // namespace

Result<void> probe_bed(Context& context, const Command&) {
    if (context.config.probe.pin == kNoPin) {
        context.not_done = true;
        return {};
    }
    ModalState& state = context.state;
    for (const Axis axis : kToolAxes)
        if (!state.homed[axis]) return make_error(ErrorCode::unavailable, "home first (G28)");
    QDUINO_TRY(context.settle());
    QDUINO_TRY(context.actions.probe_bed());
    context.stop_waiting();
    const ProbePlace last = probe_place(context.config, probe_count(context.config.mesh) - 1);
    state.machine[Axis::x] = last.x;
    state.machine[Axis::y] = last.y;
    state.machine[Axis::z] = context.config.mesh.clearance;
    return {};
}

/// M420 S V Z. V reports; a mesh that was never measured is not followed.
Result<void> follow_bed(Context& context, const Command& command) {
    BedChange change;
    QDUINO_TRY_ASSIGN(const auto on, number(command, 'S'));
    if (on) change.follow = *on != 0;
    QDUINO_TRY(take_scaled(command, 'Z', context.state.unit_mm, 0, kFadeMax_mm, change.fade_end, "mm"));
    return context.actions.change_bed(change);
}

Result<void> forget_bed(Context& context, const Command&) {
    return context.actions.change_bed({.follow = false, .forget = true});
}

Result<void> bed_profile(Context& context, const Command& command) {
    // No probe, no bed that was kept: there is nothing to load, and nothing can be measured.
    if (context.config.probe.pin == kNoPin && context.config.beds.empty()) {
        context.not_done = true;
        return {};
    }
    BedChange change;
    for (const auto& [key, profile] :
         {std::pair{"LOAD", BedProfile::load}, std::pair{"SAVE", BedProfile::save},
          std::pair{"REMOVE", BedProfile::remove}}) {
        const auto name = word_value(command.text, key);
        if (!name) continue;
        change.profile = profile;
        change.name = *name;
        if (profile == BedProfile::load) change.follow = true;
    }
    if (change.profile == BedProfile::none)
        return make_error(ErrorCode::invalid_argument, "needs LOAD, SAVE or REMOVE, and a name");
    return context.actions.change_bed(change);
}

/// M852 I J K: XY, XZ and YZ; S is the older name of I. Without a letter it changes nothing.
Result<void> skew(Context& context, const Command& command) {
    SkewConfig skew = context.state.skew;
    bool given = false;
    const auto take = [&](char letter, double& factor) -> Result<void> {
        QDUINO_TRY_ASSIGN(const auto value,
                          number_within(command, letter, -kSkewMax, kSkewMax, "(a tangent)"));
        given = given || value.has_value();
        factor = value.value_or(factor);
        return {};
    };
    QDUINO_TRY(take('S', skew.xy));
    QDUINO_TRY(take('I', skew.xy));
    QDUINO_TRY(take('J', skew.xz));
    QDUINO_TRY(take('K', skew.yz));
    if (!given) return {};
    QDUINO_TRY(context.actions.change_bed({.skew = skew}));
    context.state.skew = skew;
    return {};
}

/// SET_SKEW XY=AC,BD,AD XZ=… YZ=…, or CLEAR=1.
Result<void> set_skew(Context& context, const Command& command) {
    SkewConfig skew = context.state.skew;
    QDUINO_TRY_ASSIGN(const auto clear, word_number(command, "CLEAR"));
    if (clear.value_or(0) != 0) skew = {};
    for (const auto& [key, factor] :
         {std::pair{"XY", &skew.xy}, std::pair{"XZ", &skew.xz}, std::pair{"YZ", &skew.yz}}) {
        const auto lengths = word_value(command.text, key);
        if (!lengths) continue;
        QDUINO_TRY_ASSIGN(*factor, skew_of(*lengths));
    }
    QDUINO_TRY(context.actions.change_bed({.skew = skew}));
    context.state.skew = skew;
    return {};
}

}  // namespace qduino::printer::gcode::handlers
