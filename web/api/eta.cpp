#include "web/api/eta.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace qduino::web::api {
namespace {

constexpr double kTrustAfter_s = 120;  ///< so long, the ratio counts half
constexpr double kRatioMin = 0.2, kRatioMax = 5;

struct Profile {
    double step_s = 0;
    std::vector<std::uint64_t> bytes;
    double heating_s = 0;
    std::uint64_t heated_byte = 0;
};

/// Facts may be an older program's, or a file that somebody has edited.
Profile profile_of(const nlohmann::ordered_json& facts) {
    Profile profile;
    if (!facts.contains("profile") || !facts["profile"].is_object()) return profile;
    const auto& given = facts["profile"];
    const auto number = [&](const char* key) {
        const bool fits = given.contains(key) && given[key].is_number() && given[key] >= 0;
        return fits ? given[key].template get<double>() : 0.0;
    };
    profile.step_s = number("step_s");
    profile.heating_s = number("heating_s");
    profile.heated_byte = static_cast<std::uint64_t>(number("heated_byte"));
    if (!given.contains("bytes") || !given["bytes"].is_array()) return profile;
    for (const auto& byte : given["bytes"])
        if (byte.is_number_unsigned()) profile.bytes.push_back(byte);
    return profile;
}

/// The estimated time of motion behind `byte`; of a place where the file rests for a while (a
/// dwell), the end of that rest is `*until_s`.
double time_at(const Profile& profile, std::uint64_t byte, std::uint64_t size, double motion_s,
               double* until_s) {
    const auto& bytes = profile.bytes;
    const auto at = std::ranges::lower_bound(bytes, byte);
    const auto steps = static_cast<double>(at - bytes.begin());
    const double begin_s = std::min(motion_s, steps * profile.step_s);
    const double end_s = at == bytes.end() ? motion_s : std::min(motion_s, begin_s + profile.step_s);
    const std::uint64_t from = at == bytes.begin() ? 0 : *(at - 1);
    const std::uint64_t to = std::max(at == bytes.end() ? size : *at, from + 1);
    const double share = static_cast<double>(byte - from) / static_cast<double>(to - from);
    const double time_s = begin_s + std::min(share, 1.0) * (end_s - begin_s);
    const auto last = std::ranges::upper_bound(bytes, byte);
    *until_s = std::max(time_s, static_cast<double>(last - bytes.begin()) * profile.step_s);
    return time_s;
}

}  // namespace

double remaining_s(const nlohmann::ordered_json& facts, double estimated_s, std::uint64_t size,
                   const Executed& executed) {
    const Profile profile = profile_of(facts);
    const double motion_s = std::max(0.0, estimated_s - profile.heating_s);
    const double measured_s = std::max(0.0, executed.time_s - executed.heating_s);
    double rest_until_s = 0;
    double done_s = time_at(profile, std::min(executed.bytes, size), size, motion_s, &rest_until_s);
    done_s = std::clamp(measured_s, done_s, rest_until_s);
    const double ratio =
        std::clamp((measured_s + kTrustAfter_s) / (done_s + kTrustAfter_s), kRatioMin, kRatioMax);
    const bool heats = executed.bytes <= profile.heated_byte;
    const double heating_s = heats ? std::max(0.0, profile.heating_s - executed.heating_s) : 0;
    return std::max(0.0, motion_s - done_s) * ratio + heating_s;
}

}  // namespace qduino::web::api
