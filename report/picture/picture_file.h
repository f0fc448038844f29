// The file that a picture goes to: .svg, or .png where the computer can make one.
#pragma once

#include <string>

#include "base/result.h"

namespace qduino::apps::picture {

/// Error: invalid_argument, unless the name ends in .svg or .png; not_found for .png when
/// rsvg-convert (librsvg) is not installed. Both say what to do. Ask before anything runs for long.
[[nodiscard]] Result<void> check_picture_name(const std::string& path);

/// Writes a page of SVG to `path`, for .png as pixels at twice the page's size. Error: it cannot be
/// written there, or rsvg-convert failed.
[[nodiscard]] Result<void> write_picture(const std::string& path, const std::string& svg);

}  // namespace qduino::apps::picture
