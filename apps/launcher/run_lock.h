// One printer for each state folder: every process of the printer holds a lock, so the lock lasts
// as long as any of them lives.
//
// The launcher may be killed. Its children then stop by themselves, which takes a moment. A printer
// that is started in that moment waits for them, and names those that stay.
//
// The folder in memory through which the printer's processes meet: the pins, the link and the
// inspector's socket.
//
// It lies in /dev/shm and never on a disk, whose write-back would stall a real-time loop. Each
// process of the printer keeps it locked while it lives (lock_file() below). So a folder that can
// be locked was left by a killed printer. The next start removes it, whichever state folder it
// served.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
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

/// The processes that have `file` open, except this one. Only root sees those of all users.
[[nodiscard]] std::vector<Holder> holders_of(const std::filesystem::path& file);
/// "printer (812), printd (815)"
[[nodiscard]] std::string names_of(const std::vector<Holder>& holders);

/// Locks `file`, made when missing. Children inherit the descriptor and the lock (flock(2): the
/// lock belongs to the open file). Waits up to `patience`. Errors: already_exists, not_permitted
/// (what has the name is no plain file of this user, of root, or of the folder's owner), and what
/// the kernel says.
[[nodiscard]] Result<posix::UniqueFd> lock_file(const std::filesystem::path& file, Nanoseconds patience);

class MemoryFolder {
  public:
    static constexpr const char* kParent = "/dev/shm";

    MemoryFolder() = default;
    MemoryFolder(MemoryFolder&&) noexcept = default;
    MemoryFolder& operator=(MemoryFolder&&) noexcept = default;
    /// Removes it, when this process made it.
    ~MemoryFolder();

    /// Makes a new folder below `parent`, of this process's user. The group `users` may go through
    /// it, and neither read nor write it: what it may use in there is given to it file by file. The
    /// error is the kernel's.
    [[nodiscard]] static Result<MemoryFolder> make(const std::filesystem::path& parent,
                                                   std::optional<gid_t> users = std::nullopt);
    /// Removes the folders that killed printers left below `parent`, and returns how many. Leaves
    /// other users' folders alone, silently.
    static int sweep(const std::filesystem::path& parent);

    [[nodiscard]] std::filesystem::path file(std::string_view name) const { return path_ / name; }

  private:
    std::filesystem::path path_;
    posix::UniqueFd lock_;
};

}  // namespace qduino::launcher
