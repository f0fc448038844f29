// What takes a core's time above every loop, as the report of an admission and a certificate have
// it.
#pragma once

#include <nlohmann/json.hpp>

#include "sched/load.h"

namespace qduino::apps {

/// Durations in ns. The pair for short windows is there where it says anything (sched/load.h).
[[nodiscard]] inline nlohmann::ordered_json interferer_json(const sched::PlatformInterferer& each) {
    nlohmann::ordered_json out{{"name", each.name.view()},
                               {"cost_ns", each.cost.count()},
                               {"interval_ns", each.interval.count()},
                               {"jitter_ns", each.jitter.count()}};
    if (each.peak_interval > Nanoseconds{0}) {
        out["peak_interval_ns"] = each.peak_interval.count();
        out["peak_jitter_ns"] = each.peak_jitter.count();
    }
    return out;
}

}  // namespace qduino::apps
