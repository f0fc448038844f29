// What ran in each tick, and the most that ran in any window of a given length: all windows are
// looked at.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace qduino::sched {

/// One entry per tick: whether the server ran.
using Ran = std::vector<std::uint8_t>;

inline std::int64_t most_in_window(const Ran& ran, std::int64_t length) {
    std::int64_t inside = 0;
    std::int64_t most = 0;
    for (std::size_t t = 0; t < ran.size(); ++t) {
        inside += ran[t];
        if (static_cast<std::int64_t>(t) >= length) inside -= ran[t - static_cast<std::size_t>(length)];
        most = std::max(most, inside);
    }
    return most;
}

}  // namespace qduino::sched
