// The sketch as a child process: started, watched, ended.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::supervisor {

/// How a process ended, from waitid(2).
struct Ending {
    bool by_signal = false;
    int status = 0;  ///< exit status, or the signal's number
    /// The status as a shell reports it: the status, or 128 + signal.
    [[nodiscard]] int exit_status() const { return by_signal ? 128 + status : status; }
};

class SketchProcess {
  public:
    /// Starts `command`. If the supervisor itself is killed, the sketch gets SIGTERM: the heat
    /// watch may be dead, too, and then the sketch must stop and force its own pins. Error:
    /// not_found and the like, from execvp; nothing runs then.
    static Result<SketchProcess> start(const std::vector<std::string>& command);

    [[nodiscard]] pid_t pid() const { return pid_; }
    /// Readable once the process is dead.
    [[nodiscard]] int descriptor() const { return pidfd_.get(); }
    /// True when it is dead, with how it died. Does not reap it, and cannot wait.
    [[nodiscard]] bool ended(Ending& ending) const;

  private:
    pid_t pid_ = -1;
    posix::UniqueFd pidfd_;
};

}  // namespace qduino::supervisor
