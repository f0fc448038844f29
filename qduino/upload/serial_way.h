// The way to Serial of an uploaded sketch: a socket here, or a child that talks to the other
// computer by ssh.
#pragma once

#include <sys/types.h>

#include <string>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::apps {

struct SerialWay {
    posix::UniqueFd socket;
    pid_t child = 0;  ///< 0: none
};

/// `host` as ssh takes it; empty: this computer. Error: not_found, no uploaded sketch runs here;
/// ssh cannot be started. What the other computer lacks is seen when its way ends.
[[nodiscard]] Result<SerialWay> open_way(const std::string& host);

/// Lets go of it, and waits for its child. Returns the status of that; 0: there was none.
int close_way(SerialWay& way);

}  // namespace qduino::apps
