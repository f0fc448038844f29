// The time of each kind of line, by the slicer's comments: what was executed, line by line
// (twin/line_clock.h), added up over the lines between two comments.
//
//   ;TYPE:External perimeter        PrusaSlicer, Cura and their kin
//   ; FEATURE: Outer wall           Bambu Studio
//   ; feature solid layer           Simplify3D
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace qduino::apps {

struct FeatureTime {
    std::string name;  ///< in the slicer's words; empty: before the first comment
    double seconds = 0;
};

/// The feature that begins at this line of a file; nothing when it is no such comment.
[[nodiscard]] std::optional<std::string_view> feature_of(std::string_view line);

/// The features of the file at `path`, the longest first. `seconds`: how long each line took, from
/// line 1 at index 1. A file that cannot be read has none.
[[nodiscard]] std::vector<FeatureTime> time_by_feature(const std::string& path,
                                                       const std::vector<float>& seconds);

}  // namespace qduino::apps
