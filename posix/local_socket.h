// Stream sockets by a path in the file system.
#pragma once

#include <sys/un.h>

#include <filesystem>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::posix {

/// Error: the path is empty, or has more than 107 bytes.
[[nodiscard]] Result<sockaddr_un> local_address(const std::filesystem::path& path);

/// Listens at `path`, in the place of what a dead process left there; nobody else's processes may
/// connect. Accepting does not block. At most `waiting` callers wait. The caller knows that nobody
/// listens there now. Errors: those of local_address(), the system's.
[[nodiscard]] Result<UniqueFd> listen_local(const std::filesystem::path& path, int waiting);

/// `flags`: SOCK_NONBLOCK or 0. Error: nobody listens there; those of local_address().
[[nodiscard]] Result<UniqueFd> connect_local(const std::filesystem::path& path, int flags = 0);

/// Sends the open `descriptor` through `socket` (SCM_RIGHTS): the other side has it as well then.
/// Does not wait. Error: the system's.
[[nodiscard]] Result<void> send_descriptor(int socket, int descriptor);

/// Receives one, within `patience_ms`. Errors: timed_out, corrupt (the other side sent none), the
/// system's.
[[nodiscard]] Result<UniqueFd> receive_descriptor(int socket, int patience_ms);

}  // namespace qduino::posix
