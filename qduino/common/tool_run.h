// Programs of others that make, fetch or unpack a file for `qduino`: git, curl, grub-mkimage.
#pragma once

#include <filesystem>
#include <string_view>

#include "base/result.h"
#include "qduino/common/words.h"

namespace qduino::apps {

/// Runs `command` to its end, with what it says in `log`. Error: unavailable, with the last line of
/// what it said; or what run_into() says, with `package`, where that is given, as what to install.
Result<void> run_tool(const Words& command, const std::filesystem::path& log, std::string_view package = {});

}  // namespace qduino::apps
