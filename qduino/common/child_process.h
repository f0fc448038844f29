// Programs that `qduino` runs: the compiler, the sketch, the supervisor.
#pragma once

#include <sys/types.h>

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

/// Descriptors that a child gets in the place of this program's; −1: it has the same.
struct ChildStreams {
    int input = -1, output = -1, errors = -1;
};
/// Starts `command`, and returns its process id. No signal is blocked in it, and SIGPIPE is not
/// ignored. Error: it could not be started.
Result<pid_t> start(const std::vector<std::string>& command, const ChildStreams& streams);
/// Waits for the end of a child, and returns as run_into().
int wait_for(pid_t child);

/// Becomes `command`. Returns only when that failed.
Error become(const std::vector<std::string>& command);

}  // namespace qduino::apps
