// What is known of a file of G-code, as the JSON object `facts` of a job (docs/api.md).
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "printer/estimate/estimator.h"
#include "printer/preflight/facts.h"

namespace qduino::printer {

/// `estimate`: as it stands when nothing was estimated, where nobody asked for one.
[[nodiscard]] nlohmann::ordered_json facts_json(const preflight::Facts& facts,
                                                const estimate::Estimate& estimate);
/// What is wrong and what to do, as one text.
[[nodiscard]] std::string sentence_of(const preflight::Finding& finding);
[[nodiscard]] inline double tenths(double seconds) { return std::round(seconds * 10) / 10; }

}  // namespace qduino::printer
