// The state folder becomes the service's own, when root starts the printer.
//
// Root walks through a folder in which somebody else may have planted things: a link to /etc, a
// second name (hard link) of /etc/shadow, a pipe. To give these away would give away the computer.
// So it is done in this order, on open descriptors that never follow a link:
//
//   1. close    the folder, and each one in it, becomes root's alone (0700): nobody plants any more
//   2. look     every entry is one of ours by its name, and a plain file with one name, or a folder
//   3. give     only then is everything given to the user
//
// A folder that holds anything else is refused with the name of that, and stays as it was.
#pragma once

#include <sys/types.h>

#include <filesystem>

#include "base/result.h"

namespace qduino::rights {

/// Gives the folder at `path`, made when missing, to `user` and `group`. A folder of root, and one
/// of the user "nobody" (as which earlier versions ran), is taken over; one that is the user's
/// already is left alone. Root only. Errors: not_permitted (what is in the way), the system's.
[[nodiscard]] Result<void> hand_over_state(const std::filesystem::path& path, uid_t user, gid_t group);

}  // namespace qduino::rights
