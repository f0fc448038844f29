// Programs that `qduino` runs: the compiler, the sketch, the supervisor.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace qduino::apps {

/// The words of a command as one would type them in a shell: for --verbose.
[[nodiscard]] std::string shell_words(const std::vector<std::string>& command);

/// Runs `command` to its end with its output and errors in `output`. Returns its exit status, 128 +
/// signal when it was killed. Error: it could not be started. May be called from several threads.
Result<int> run_into(const std::vector<std::string>& command, const std::filesystem::path& output);

/// Runs `command` to its end on this terminal. Hands on signals that were sent to this process
/// alone; the terminal's reach both. Returns as run_into().
Result<int> run_in_front(const std::vector<std::string>& command);

/// Becomes `command`. Returns only when that failed.
Error become(const std::vector<std::string>& command);

}  // namespace qduino::apps
