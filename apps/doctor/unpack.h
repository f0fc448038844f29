// Reads a gzip file with the system's gzip: for /proc/config.gz.
#pragma once

#include <optional>
#include <string>

namespace qduino::apps::doctor {

/// The output of `gzip -dc`; nothing when gzip is missing or refuses the file.
std::optional<std::string> unpacked(const std::string& path);

}  // namespace qduino::apps::doctor
