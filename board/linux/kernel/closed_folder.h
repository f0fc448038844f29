// Folders that are closed even to their owner, as the topmost control groups are: root may make no
// group there, unless it has the right to pass over all permissions (CAP_DAC_OVERRIDE). That right
// is also one to write every file of every user. But an owner may change what is permitted: the
// folder is opened to its owner for as long as the change takes, and closed again.
//
// A process that is killed in between leaves the folder open to its owner alone.
#pragma once

#include <string>

#include "base/result.h"

namespace qduino::board::linux {

/// Folders may be made in `folder` by the functions below.
[[nodiscard]] bool takes_folders(const std::string& folder);
/// mkdir(2) with 0755. Errors: already_exists, the system's.
[[nodiscard]] Result<void> make_folder_in_closed(const std::string& path);
/// rmdir(2). Errors: not_found, unavailable (something is in it), the system's.
[[nodiscard]] Result<void> remove_folder_in_closed(const std::string& path);

}  // namespace qduino::board::linux
