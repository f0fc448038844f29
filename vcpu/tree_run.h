// Runs a command inside a VCPU, to the end of all that it has started.
//
//   signal to this process          the command gets it; the terminal's Ctrl-C reaches it by itself
//   the command has ended           its daemons go on in the VCPU, and are waited for
//   asked to end, command gone      what is left is asked to end (SIGTERM), and killed after 2 s
//   this process is killed          the witness does the same (witness.h)
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/result.h"
#include "vcpu/process_vcpu.h"

namespace qduino::apps {

struct TreeEnd {
    int status = 0;        ///< of the command: its exit status, or 128 + the signal that killed it
    Nanoseconds lasted{};  ///< from its start to the end of its last process
};

/// `on_daemons` is called once when the command has ended and left processes. Status 126 and 127,
/// as from a shell: the command cannot be run, or is not there. Error: no process could be started,
/// or it could not enter the VCPU. Blocks SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1, SIGUSR2 and
/// SIGCHLD in this process for good; it must have one thread.
[[nodiscard]] Result<TreeEnd> run_tree(const ProcessVcpu& vcpu, const std::vector<std::string>& command,
                                       const std::function<void()>& on_daemons);

}  // namespace qduino::apps
