#include "apps/printer_sim/observed.h"

#include "terminal/human.h"

namespace qduino::apps {
namespace {

using Json = nlohmann::ordered_json;
using twin::Heights;

/// So many of each kind of fault are told to a person.
constexpr std::size_t kTold = 3;

/// Adds the line and the place to `json`.
Json at_place(const twin::PlaceOfLine& place, Json json) {
    json["line"] = place.line;
    json["x_mm"] = place.mm[0];
    json["y_mm"] = place.mm[1];
    json["z_mm"] = place.mm[2];
    return json;
}

/// In millimetres.
double quantile_mm(const Heights& heights, double share) {
    return static_cast<double>(heights.error_nm.quantile(share)) * 1e-6;
}

}  // namespace

Observed observed(twin::PrintRecord& record, Instant now, const std::string& path) {
    Observed seen{.heights = record.finish(now), .peak_steps_s = {}, .features = {}, .rested_s = 0};
    for (std::size_t axis = 0; axis < twin::kAxisCount; ++axis)
        seen.peak_steps_s[axis] = record.rates().peak(axis);
    seen.features = time_by_feature(path, record.clock().seconds());
    seen.rested_s = record.clock().rested_s();
    return seen;
}

Json heights_json(const Heights& heights) {
    Json spots = Json::array(), oozes = Json::array();
    for (const twin::LateSpot& spot : heights.late_spots)
        spots.push_back(at_place(spot.place, {{"late_s", spot.late_s}, {"rise_mm", spot.rise_mm}}));
    for (const twin::Ooze& ooze : heights.oozes)
        oozes.push_back(at_place(ooze.from, {{"volume_mm3", ooze.volume_mm3}, {"way_mm", ooze.way_mm}}));
    return {{"asked_mm3", heights.asked_mm3},
            {"laid_mm3", heights.laid_mm3},
            {"travel_ooze_mm3", heights.travel_ooze_mm3},
            {"rest_ooze_mm3", heights.rest_ooze_mm3},
            {"in_nozzle_mm3", heights.in_nozzle_mm3},
            {"cells", heights.error_nm.count()},
            {"error_mm",
             {{"p50", quantile_mm(heights, 0.5)},
              {"p99", quantile_mm(heights, 0.99)},
              {"max", quantile_mm(heights, 1)}}},
            {"worst", at_place(heights.worst, {{"error_mm", heights.worst_error_mm}})},
            {"late_spots", heights.late_spot_count},
            {"worst_late_spots", std::move(spots)},
            {"worst_oozes", std::move(oozes)}};
}

Json features_json(const Observed& seen) {
    Json list = Json::array();
    for (const FeatureTime& feature : seen.features)
        list.push_back({{"name", feature.name}, {"seconds", feature.seconds}});
    return list;
}

std::string summary(const Observed& seen) {
    const Heights& heights = seen.heights;
    std::string out =
        text<std::string>("  height    off by p50 ", Fixed{quantile_mm(heights, 0.5), 4}, "  p99 ",
                          Fixed{quantile_mm(heights, 0.99), 4}, "  max ", Fixed{quantile_mm(heights, 1), 4},
                          " mm (line ", heights.worst.line, ")\n  ooze      ", Fixed{heights.travel_ooze_mm3},
                          " mm3 on travel, ", Fixed{heights.rest_ooze_mm3}, " mm3 at rest\n");
    for (std::size_t i = 0; i < std::min(kTold, heights.late_spots.size()); ++i) {
        const twin::LateSpot& spot = heights.late_spots[i];
        write(out, "  late      line ", spot.place.line, ": ", human_duration(from_seconds(spot.late_s)),
              ", ", Fixed{spot.rise_mm, 3}, " mm thicker at X ", Fixed{spot.place.mm[0]}, " Y ",
              Fixed{spot.place.mm[1]}, " Z ", Fixed{spot.place.mm[2]}, '\n');
    }
    if (heights.late_spot_count > kTold)
        write(out, "  late      ", heights.late_spot_count, " spots in all\n");
    return out;
}

}  // namespace qduino::apps
