// One printer a state folder: a lock that every process of the printer holds, so that it lasts as long as any of them lives.
//
// The launcher may be killed. Its children then stop by themselves, which takes a moment: a printer that is started in that moment
// waits for them, and names those that stay.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "posix/unique_fd.h"

namespace qduino::launcher {

struct Holder {
    int pid = 0;
    std::string name;  ///< as in /proc/PID/comm
};

/// The processes that have `file` open, but for this one. Only root sees everybody's.
[[nodiscard]] std::vector<Holder> holders_of(const std::filesystem::path& file);
/// "printer (812), printd (815)"
[[nodiscard]] std::string names_of(const std::vector<Holder>& holders);

/// Locks `file`, made when missing. The descriptor is handed on to children, and the lock with it (flock(2): it belongs to
/// the open file). Waits up to `patience`. Errors: already_exists, not_permitted, and what open(2) says.
[[nodiscard]] Result<posix::UniqueFd> lock_file(const std::filesystem::path& file, Nanoseconds patience);

}  // namespace qduino::launcher
