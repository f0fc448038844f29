// Files that a power cut or a kill finds whole or not at all: written beside, synced, then named.
#pragma once

#include <filesystem>
#include <string_view>

#include "base/result.h"

namespace qduino::posix {

/// A file or a folder, to the disk. Error: the system's.
[[nodiscard]] Result<void> sync_to_disk(const std::filesystem::path& path);

/// The new name, to the disk. The bytes must be there already. Error: the system's.
[[nodiscard]] Result<void> rename_and_sync(const std::filesystem::path& from,
                                           const std::filesystem::path& to);

/// A small file (mode 0600), whole on the disk before it has its name; the name itself is synced with the
/// folder, by the caller. Error: the system's; the old file stays then.
[[nodiscard]] Result<void> write_durably(const std::filesystem::path& path, std::string_view bytes);

}  // namespace qduino::posix
