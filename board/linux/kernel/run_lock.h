// One printer for each state folder: every process of the printer holds a lock, so the lock lasts
// as long as any of them lives.
//
// The launcher may be killed. Its children then stop by themselves, which takes a moment. A printer
// that is started in that moment waits for them, and names those that stay.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

struct LockHolder {
    int pid = 0;
    std::string name;  ///< as in /proc/PID/comm
};

/// The processes that have `file` open, except this one. Only root sees those of all users.
[[nodiscard]] std::vector<LockHolder> holders_of(const std::filesystem::path& file);
/// "printer (812), printd (815)"
[[nodiscard]] std::string names_of(const std::vector<LockHolder>& holders);

/// Locks `file`, made when missing. Children inherit the descriptor and the lock (flock(2): the
/// lock belongs to the open file). Waits up to `patience`. Errors: already_exists, not_permitted
/// (what has the name is no plain file of this user, of root, or of the folder's owner), and what
/// the kernel says.
[[nodiscard]] Result<posix::UniqueFd> lock_file(const std::filesystem::path& file, Nanoseconds patience);

}  // namespace qduino::board::linux
