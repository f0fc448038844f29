// `qduino new`: a sketch to begin with.
#pragma once

#include <filesystem>

#include "base/result.h"

namespace qduino::apps {

/// Makes the folder `path`, and in it an .ino of the same name with two loops. Returns the .ino.
/// Error: already_exists (nothing is overwritten), invalid_argument (no sketch can have this name),
/// or the folder cannot be made.
Result<std::filesystem::path> make_sketch(const std::filesystem::path& path);

}  // namespace qduino::apps
