// Programs that `qduino` runs: the compiler, the sketch, the supervisor.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace qduino::apps {

/// A command as a shell would have to be given it: for --verbose.
[[nodiscard]] std::string shell_words(const std::vector<std::string>& command);

/// Runs `command` to its end with its output and errors in `output`. Returns its exit status, 128 + signal
/// when it was killed. Error: it could not be started. May be called from several threads.
Result<int> run_into(const std::vector<std::string>& command, const std::filesystem::path& output);

/// Runs `command` to its end on this terminal. Signals that are sent to this process alone (not by the
/// terminal, which reaches both) are handed on. Returns as run_into().
Result<int> run_in_front(const std::vector<std::string>& command);

/// Becomes `command`. Returns only when that failed.
Error become(const std::vector<std::string>& command);

}  // namespace qduino::apps
