// Files that a power cut or a kill finds whole or not at all: written beside, synced, then named.
#pragma once

#include <filesystem>
#include <span>
#include <string_view>

#include "base/result.h"

namespace qduino::spool {

/// "job files: cannot WHAT: …" for an errno. unavailable (disk full), not_permitted, or internal.
[[nodiscard]] Error file_error(std::string_view what, int number);

/// All of `bytes`, whatever a single write() takes. Errors: as file_error().
[[nodiscard]] Result<void> write_all(int descriptor, std::span<const char> bytes);

/// A file or a folder, to the disk. Errors: as file_error().
[[nodiscard]] Result<void> sync_to_disk(const std::filesystem::path& path);

/// The new name, to the disk. The bytes must be there already. Errors: as file_error().
[[nodiscard]] Result<void> rename_and_sync(const std::filesystem::path& from,
                                           const std::filesystem::path& to);

/// A small file (mode 0600), whole on the disk before it has its name; the name itself is synced with the
/// folder, by the caller. Errors: as file_error(); the old file stays then.
[[nodiscard]] Result<void> write_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace qduino::spool
