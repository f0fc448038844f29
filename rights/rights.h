// Takes from a process what it does not need, for good: a program that is broken into is worth no
// more than what it may do.
//
//   capabilities   root's rights, one by one (capabilities(7)). A program of root has those of its
//                  bounding set; what is taken from that comes back in no program that it starts
//   system calls   those that only somebody who has broken in would make (seccomp(2))
//
// docs/privileges.md has the table of all programs; a test compares it with the running ones.
#pragma once

#include <span>

#include "base/result.h"

namespace qduino::rights {

/// The rights of root that a program may keep, by their numbers (capabilities(7)).
using Capabilities = std::span<const int>;

/// Keeps of the bounding set `kept` alone, and the right to become another program with more rights
/// is gone (PR_SET_NO_NEW_PRIVS). What the process itself has stays until it becomes a program:
/// between fork and exec. Does nothing in a process that is not root's. Error: the system's.
[[nodiscard]] Result<void> bound_capabilities(Capabilities kept);

/// The same, and the process itself keeps `kept` alone. From a process with one thread.
[[nodiscard]] Result<void> keep_capabilities(Capabilities kept);

/// From now on the process and its children cannot start programs, trace others, change mounts,
/// namespaces, modules, the clock, keys, or load programs into the kernel: EPERM. For programs that
/// do none of it. Any user. From a process with one thread. Error: the system's.
[[nodiscard]] Result<void> refuse_system_calls();

}  // namespace qduino::rights
