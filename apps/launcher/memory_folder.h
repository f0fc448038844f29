// The folder in memory through which the printer's processes meet: the pins, the link and the
// inspector's socket.
//
// It lies in /dev/shm and never on a disk, whose write-back would stall a real-time loop. Each
// process of the printer keeps it locked while it lives (run_lock.h). So a folder that can be
// locked was left by a killed printer. The next start removes it, whichever state folder it served.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::launcher {

class MemoryFolder {
  public:
    static constexpr const char* kParent = "/dev/shm";

    MemoryFolder() = default;
    MemoryFolder(MemoryFolder&&) noexcept = default;
    MemoryFolder& operator=(MemoryFolder&&) noexcept = default;
    /// Removes it, when this process made it.
    ~MemoryFolder();

    /// Makes a new folder below `parent`. When root makes it, `owner` gets access, too (empty:
    /// nobody else). Errors: not_found (no such user), and what the kernel says.
    [[nodiscard]] static Result<MemoryFolder> make(const std::filesystem::path& parent,
                                                   const std::string& owner);
    /// Removes the folders that killed printers left below `parent`, and returns how many. Leaves
    /// other users' folders alone, silently.
    static int sweep(const std::filesystem::path& parent);

    [[nodiscard]] std::filesystem::path file(std::string_view name) const { return path_ / name; }

  private:
    std::filesystem::path path_;
    posix::UniqueFd lock_;
};

}  // namespace qduino::launcher
