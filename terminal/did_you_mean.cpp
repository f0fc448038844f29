#include "terminal/did_you_mean.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace qduino::apps {

int edit_distance(std::string_view a, std::string_view b) {
    // Three rows of the table: distances of the first i letters of `a` to the first j of `b`.
    std::vector<int> before_last, last, row(b.size() + 1);
    std::iota(row.begin(), row.end(), 0);
    for (std::size_t i = 1; i <= a.size(); ++i) {
        before_last = std::exchange(last, row);
        row[0] = static_cast<int>(i);
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const int exchanged = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
            row[j] = std::min({last[j] + 1, row[j - 1] + 1, exchanged});
            const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
            if (swapped) row[j] = std::min(row[j], before_last[j - 2] + 1);
        }
    }
    return row[b.size()];
}

std::string nearest(std::string_view word, std::span<const std::string> known) {
    const auto distance = [&](const std::string& candidate) { return edit_distance(word, candidate); };
    const auto best = std::ranges::min_element(known, {}, distance);
    const int slips = std::max(1, static_cast<int>(word.size() + 1) / 3);
    if (best != known.end() && distance(*best) <= slips) return *best;
    const auto begins = [&](const std::string& candidate) { return candidate.starts_with(word); };
    if (word.size() < 2 || std::ranges::count_if(known, begins) != 1) return {};
    return *std::ranges::find_if(known, begins);
}

}  // namespace qduino::apps
