// Makes, opens and maps the file of virtual pins (pins_layout.h), with all checks in one place.
#pragma once

#include <cstddef>
#include <string>

#include "base/result.h"
#include "board/window/pins_layout.h"
#include "posix/mapping.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

/// The roles that hold the file, each by one process at a time.
enum class PinsRole : int { machine = 0, sketch = 1, supervisor = 2 };

/// The opened file: descriptor (which carries the role's lock) and the mapped head.
class PinsFile {
  public:
    PinsFile() = default;  ///< none; only for assignment

    /// Makes a fresh file and renames it over `path`. For the machine. Error: unavailable when
    /// another machine lives on `path`; or the system's.
    static Result<PinsFile> create(const std::string& path);
    /// The same in existing memory, from `offset` of the device `path` on (/dev/mem): as many
    /// rings as a board without Linux has writers. What was in it is gone. Error: as create().
    static Result<PinsFile> create_in(const std::string& path, std::size_t offset);
    /// Opens an existing file in a role. Error: not_found (no machine has made it), corrupt (not
    /// such a file), unsupported (another version), unavailable (the role is taken by a living
    /// process).
    static Result<PinsFile> open(const std::string& path, PinsRole role);

    [[nodiscard]] bool valid() const { return head_.valid(); }
    [[nodiscard]] PinsLayout& layout() const { return *head_.as<PinsLayout>(); }
    /// Maps one writer's ring. Contract: 0 <= writer < kWriterCount.
    [[nodiscard]] Result<posix::Mapping> map_ring(int writer, bool populate) const;

  private:
    void begin();

    posix::UniqueFd fd_;
    std::size_t offset_ = 0;  // of the layout in it
    posix::Mapping head_;
};

}  // namespace qduino::board::linux
