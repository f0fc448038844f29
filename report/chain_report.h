// The chains of a sketch at the end of a run: what was seen of each, beside its bound.
#pragma once

#include <string>
#include <vector>

#include "runtime/runtime.h"

namespace qduino::apps {

/// What a run saw of a chain that has a bound.
struct ChainSeen {
    const runtime::ChainVerdict* chain = nullptr;  ///< its bound
    std::int64_t count = 0;                        ///< reactions
    Nanoseconds reaction{}, age{};                 ///< the worst; of one without an age 0
};
/// When the loops have ended, or between two runs of a simulator.
[[nodiscard]] std::vector<ChainSeen> chains_seen(const runtime::Runtime& runtime);

/// A line for each chain that has a bound; or nothing. When the loops have ended.
[[nodiscard]] std::string chain_lines(const runtime::Runtime& runtime);

/// To follow those of periods_kept(): "; BEYOND ITS BOUND: chain stop button"; or nothing.
[[nodiscard]] std::string chain_verdict(const runtime::Runtime& runtime);

}  // namespace qduino::apps
