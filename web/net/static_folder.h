// The page's files from a folder: where there is a disk.
#pragma once

#include <cstdint>
#include <filesystem>

#include "base/result.h"
#include "web/http/static_files.h"

namespace qduino::web {

inline constexpr std::size_t kStaticFilesMax = 2000;
inline constexpr std::uint64_t kStaticBytesMax = std::uint64_t{32} << 20;

/// Reads every regular file below `folder`; links are not followed. Errors: not_found, out_of_range
/// (too many).
[[nodiscard]] Result<StaticFiles> read_static_folder(const std::filesystem::path& folder);

}  // namespace qduino::web
