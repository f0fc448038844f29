// The folder in memory through which the printer's processes meet: the pins, the link and the
// inspector's socket.
//
// It lies in /dev/shm and never on a disk, whose write-back would stall a real-time loop. Each
// process of the printer keeps it locked while it lives (run_lock.h). So a folder that can
// be locked was left by a killed printer. The next start removes it, whichever state folder it
// served.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string_view>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

class MemoryFolder {
  public:
    static constexpr const char* kParent = "/dev/shm";

    MemoryFolder() = default;
    MemoryFolder(MemoryFolder&&) noexcept = default;
    MemoryFolder& operator=(MemoryFolder&&) noexcept = default;
    /// Removes it, when this process made it.
    ~MemoryFolder();

    /// Makes a new folder below `parent`; this process's user owns it. The group `users` may go
    /// through it, and neither read nor write it: what it may use in there is given to it file by
    /// file. The error is the kernel's.
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

}  // namespace qduino::board::linux
