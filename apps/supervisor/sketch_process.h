// The sketch as a child process: started, watched, ended.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::supervisor {

/// How a process ended, as waitid(2) says it.
struct Ending {
    bool by_signal = false;
    int status = 0;  ///< exit status, or the signal's number
    /// What a shell would report: the status, or 128 + signal.
    [[nodiscard]] int exit_status() const { return by_signal ? 128 + status : status; }
};

class SketchProcess {
  public:
    /// Starts `command`. If the supervisor itself is killed the sketch gets SIGTERM: should the heat watch be dead too, nobody
    /// would force its pins, so it must stop and do it itself. Error: not_found and the like, as execvp said; nothing runs then.
    static Result<SketchProcess> start(const std::vector<std::string>& command);

    [[nodiscard]] pid_t pid() const { return pid_; }
    /// Readable once the process is dead.
    [[nodiscard]] int descriptor() const { return pidfd_.get(); }
    /// It is dead, and how it died. Does not collect it, and cannot wait.
    [[nodiscard]] bool ended(Ending& ending) const;

  private:
    pid_t pid_ = -1;
    posix::UniqueFd pidfd_;
};

}  // namespace qduino::supervisor
