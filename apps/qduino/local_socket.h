// A stream socket by a path in the file system, for processes of the same user.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::apps {

/// Listens at `path`, in the place of what a dead process left there; nobody else may connect. The
/// caller holds a lock that says there is no other. Error: the path is too long, the system's.
[[nodiscard]] Result<posix::UniqueFd> listen_local(const std::filesystem::path& path);

/// Error: nobody listens there.
[[nodiscard]] Result<posix::UniqueFd> connect_local(const std::filesystem::path& path);

}  // namespace qduino::apps
