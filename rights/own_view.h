// A process sees its own files and its own network, and nothing else of the computer: whoever
// breaks into it finds no home, no /etc, no program to start, and no other service to speak to.
//
//   files     a mount namespace whose root is an empty folder in memory, with the named folders in
//             it at the places that they have
//   network   a network namespace without any device. Sockets that are open stay those of the
//             network in which they were made: a service listens first
//
// mount_namespaces(7), network_namespaces(7).
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"

namespace qduino::rights {

struct SeenFolder {
    std::filesystem::path path;  ///< a folder or a file, absolute; what is missing is left out
    bool writable = false;
};

/// Root only, from a process with one thread. From then on the process sees `folders` alone.
/// Errors: the system's, not_permitted for one (no namespaces here). It then sees what it saw.
[[nodiscard]] Result<void> see_only(std::vector<SeenFolder> folders);

/// From then on the calling thread, and those that it makes, have no network but their open
/// sockets. With CAP_SYS_ADMIN. Error: the system's.
[[nodiscard]] Result<void> leave_network();

}  // namespace qduino::rights
