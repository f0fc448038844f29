#include "apps/terminal/did_you_mean.h"

#include <algorithm>
#include <vector>

namespace qduino::apps {

int edit_distance(std::string_view a, std::string_view b) {
    // Three rows of the table: distances of the first i letters of `a` to the first j of `b`.
    std::vector<int> before_last(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = static_cast<int>(j);
    for (std::size_t i = 1; i <= a.size(); ++i) {
        before_last = last;
        last = row;
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
    std::string best;
    int best_distance = std::max(1, static_cast<int>(word.size() + 1) / 3) + 1;
    for (const std::string& candidate : known) {
        const int distance = edit_distance(word, candidate);
        if (distance >= best_distance) continue;
        best = candidate;
        best_distance = distance;
    }
    if (!best.empty() || word.size() < 2) return best;
    const auto begins = [&](const std::string& candidate) { return candidate.rfind(word, 0) == 0; };
    if (std::count_if(known.begin(), known.end(), begins) != 1) return {};
    return *std::find_if(known.begin(), known.end(), begins);
}

}  // namespace qduino::apps
