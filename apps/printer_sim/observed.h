// What was seen of a print beyond the verdict: heights, faults with their lines, time by feature,
// peak rates. Made when a picture or a report of heights is asked for.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/printer_sim/features.h"
#include "twin/print_record.h"

namespace qduino::apps {

struct Observed {
    twin::Heights heights;
    std::array<double, twin::kAxisCount> peak_steps_s{};
    std::vector<FeatureTime> features;  ///< the longest first
    double rested_s = 0;                ///< nothing moved for a second or more: heating, pauses
};

/// What was seen of the print of the file at `path`. Ends `record`.
[[nodiscard]] Observed observed(twin::PrintRecord& record, Instant now, const std::string& path);

/// Keys as docs/printer-sim.md lists them under `layer_height`.
[[nodiscard]] nlohmann::ordered_json heights_json(const twin::Heights& heights);
/// [{"name", "seconds"}…]
[[nodiscard]] nlohmann::ordered_json features_json(const Observed& seen);
/// The lines of the summary.
[[nodiscard]] std::string summary(const Observed& seen);

}  // namespace qduino::apps
