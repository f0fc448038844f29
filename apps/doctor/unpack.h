// Reading a gzip file with the system's gzip: for /proc/config.gz.
#pragma once

#include <optional>
#include <string>

namespace qduino::apps::doctor {

/// What `gzip -dc` says of the file; nothing when gzip is not there or refuses it.
std::optional<std::string> unpacked(const std::string& path);

}  // namespace qduino::apps::doctor
