#include "apps/printer_sim/features.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <map>

namespace qduino::apps {

std::optional<std::string_view> feature_of(std::string_view line) {
    constexpr std::array<std::string_view, 3> kWords{";TYPE:", "; FEATURE:", "; feature "};
    for (const std::string_view word : kWords) {
        if (!line.starts_with(word)) continue;
        std::string_view name = line.substr(word.size());
        name.remove_prefix(std::min(name.find_first_not_of(" \t"), name.size()));
        return name.substr(0, name.find_last_not_of(" \t\r") + 1);
    }
    return std::nullopt;
}

std::vector<FeatureTime> time_by_feature(const std::string& path, const std::vector<float>& seconds) {
    std::map<std::string, double, std::less<>> sums;
    std::ifstream file(path, std::ios::binary);
    std::string line, name;
    // Line 0 has what moved before the first line was known.
    double sum = seconds.empty() ? 0.0 : static_cast<double>(seconds[0]);
    for (std::size_t number = 1; std::getline(file, line); ++number) {
        if (const auto next = feature_of(line)) {
            sums[name] += sum;
            sum = 0;
            name = *next;
        }
        if (number < seconds.size()) sum += static_cast<double>(seconds[number]);
    }
    sums[name] += sum;
    std::vector<FeatureTime> times;
    for (const auto& [of, total] : sums) {
        if (total > 0) times.push_back({of, total});
    }
    std::ranges::stable_sort(times, std::ranges::greater{}, &FeatureTime::seconds);
    return times;
}

}  // namespace qduino::apps
