// Files that are whole or absent after a power cut or a kill: written beside, synced, then named.
#pragma once

#include <filesystem>
#include <string_view>

#include "base/result.h"

namespace qduino::posix {

/// Syncs a file or a folder to the disk. Error: the system's.
[[nodiscard]] Result<void> sync_to_disk(const std::filesystem::path& path);

/// Renames, and syncs the new name to the disk. The bytes must be there already. Error: the
/// system's.
[[nodiscard]] Result<void> rename_and_sync(const std::filesystem::path& from,
                                           const std::filesystem::path& to);

/// Writes a small file, whole on the disk before it has its name. The caller syncs the name, with
/// the folder. A new file gets `mode`, less what umask(2) takes away. Error: the system's; the old
/// file then stays.
[[nodiscard]] Result<void> write_durably(const std::filesystem::path& path, std::string_view bytes,
                                         unsigned mode = 0600);

}  // namespace qduino::posix
