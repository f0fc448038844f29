#include "terminal/human.h"

#include <array>
#include <cmath>
#include <utility>

namespace qduino::apps {
namespace {

/// Three significant digits, without zeros behind the point.
std::string three_digits(double value) {
    const double size = std::abs(value);
    std::string out = text<std::string>(Fixed{value, size < 9.995 ? 2 : size < 99.95 ? 1 : 0});
    if (out.find('.') != std::string::npos) out.erase(out.find_last_not_of('0') + 1);
    if (out.back() == '.') out.pop_back();
    return out;
}

}  // namespace

std::string human_duration(Nanoseconds duration) {
    constexpr std::array<std::pair<const char*, double>, 4> kUnits{
        {{" s", 1e9}, {" ms", 1e6}, {" us", 1e3}, {" ns", 1}}};
    const auto ns = static_cast<double>(duration.count());
    for (const auto& [name, size] : kUnits) {
        // From here on it would be rounded to 1000 of the next smaller unit.
        if (std::abs(ns) >= size * 0.9995 || size == 1) return three_digits(ns / size) + name;
    }
    return {};
}

std::string counted(long long count, const std::string& what) {
    if (count != 1 && what.ends_with("ry"))
        return text<std::string>(count, ' ', what.substr(0, what.size() - 1), "ies");
    return text<std::string>(count, ' ', what, count == 1 ? "" : "s");
}

}  // namespace qduino::apps
