// Real-time work in a child process, with a limit that the parent keeps: whatever the child does,
// it ends, and the computer is as before.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"

namespace qduino::bench {

/// Forks; the child runs `work` and leaves with its status. Until then the parent calls `meanwhile`
/// every 20 ms. After `limit` the child gets SIGTERM, 3 s later SIGKILL, and the settings that it
/// left changed are undone. A real-time thread of the child that does not sleep is ended by the
/// kernel soon after that, though nobody lives who would end it (RLIMIT_RTTIME). Empty: the child
/// left with status 0; else what happened. The caller has no other threads.
std::string run_child(const std::function<int()>& work, Nanoseconds limit,
                      const std::function<void()>& meanwhile = {});

/// For `work`: says on standard error why it cannot go on, which task has the core for one, and is
/// its status.
int cannot(const Error& why);

/// The same with a program: `command[0]` is looked for beside this one. Its standard error goes to
/// `log_path`.
std::string run_program(const std::vector<std::string>& command, Nanoseconds limit,
                        const std::string& log_path, const std::function<void()>& meanwhile = {});

/// Full path of a program that was built with this one.
std::string program_beside(const std::string& name);

/// True once Ctrl-C or SIGTERM came (after the first call of run_child). The running child was then
/// ended, and the benchmark should end, too.
bool interrupted();

}  // namespace qduino::bench
