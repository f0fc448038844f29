// Machine files: the TOML form of printer/machine_config.h. docs/machine.md lists every key.
#pragma once

#include <filesystem>
#include <string_view>

#include "base/result.h"
#include "printer/machine_config.h"

namespace qduino::apps {

/// Reads a machine file: what it leaves out keeps the reference machine's value, and an empty path
/// gives that machine. Error: names file, line and key for a syntax error, an unknown key, a value
/// of the wrong kind or out of its range.
Result<printer::MachineConfig> read_machine_file(const std::filesystem::path& path);

/// The same from text; `name` stands for the file in messages.
Result<printer::MachineConfig> parse_machine(std::string_view text, std::string_view name);

}  // namespace qduino::apps
