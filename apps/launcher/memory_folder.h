// Where the printer's processes meet: a folder in memory with the pins, the link and the inspector's socket.
//
// In /dev/shm and never on a disk, whose write-back would stall a real-time loop. The folder is locked as long as any process of
// the printer lives (run_lock.h). So a folder that can be locked is one that a killed printer left behind: it is removed at the next
// start, whoever's state folder it served.
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

    /// A new folder below `parent`; for the user `owner` too, when root makes it (empty: for nobody else). Errors: not_found
    /// (no such user), and what the kernel says.
    [[nodiscard]] static Result<MemoryFolder> make(const std::filesystem::path& parent,
                                                   const std::string& owner);
    /// Removes what killed printers left below `parent`. Returns how many folders. Others' folders are left alone, silently.
    static int sweep(const std::filesystem::path& parent);

    [[nodiscard]] std::filesystem::path file(std::string_view name) const { return path_ / name; }

  private:
    std::filesystem::path path_;
    posix::UniqueFd lock_;
};

}  // namespace qduino::launcher
