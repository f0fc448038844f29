// Machine files: the TOML form of printer/machine_config.h. docs/machine.md lists every key.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "printer/machine_config.h"

namespace qduino::apps {

class TomlSection;
/// Takes further keys out of the file's own section: what a twin's file says beside the printer's.
using ReadMore = std::function<void(TomlSection& root)>;

/// Reads a machine file: what it leaves out keeps the reference machine's value, and an empty path
/// gives that machine. Error: names file, line and key for a syntax error, an unknown key, a value
/// of the wrong kind or out of its range.
Result<printer::MachineConfig> read_machine_file(const std::filesystem::path& path,
                                                 const ReadMore& read_more = {});

/// The same from text; `name` stands for the file in messages.
Result<printer::MachineConfig> parse_machine(std::string_view text, std::string_view name,
                                             const ReadMore& read_more = {});

/// Reads `text` into `machine`, which holds the reference machine. Returns the error at its full
/// length (an Error's text is bounded, and a list of keys may be long); empty: none.
[[nodiscard]] std::string machine_error(std::string_view text, std::string_view name,
                                        printer::MachineConfig& machine, const ReadMore& read_more = {});

// What M500 keeps is a file of its own, in the service's state folder: the gains and models of the
// heaters, in the keys of a machine file, and the beds that were measured. It goes before the
// machine file. The sketch gives it to the service over the link, which writes it whole, or not.

/// The kept file's text.
[[nodiscard]] std::string kept_text(const printer::HeaterSettings& hot_end,
                                    const printer::HeaterSettings& bed, const printer::KeptBeds& beds);
/// Puts the kept file's `text` over `machine`. Error: names line and key, and nothing is changed.
[[nodiscard]] Result<void> apply_kept(std::string_view text, std::string_view name,
                                      printer::MachineConfig& machine);
/// A machine file, and the kept file over it; `kept` may be empty or not there.
Result<printer::MachineConfig> read_machine_files(const std::filesystem::path& path,
                                                  const std::filesystem::path& kept);

}  // namespace qduino::apps
