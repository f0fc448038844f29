// `qduino metal beside`: an image on a core that Linux gives up for as long as it runs.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "qduino/arguments.h"

namespace qduino::apps {

/// Runs the image of the sketch `name`, and tells what was seen at its pins. Returns the exit
/// status: 0, 1 on failure and when Linux was silent, 2 when admission refuses the sketch. Error:
/// what this computer lacks for it, and what to do.
[[nodiscard]] Result<int> run_beside_linux(const Arguments& arguments, const std::filesystem::path& image,
                                           const std::string& name);

}  // namespace qduino::apps
