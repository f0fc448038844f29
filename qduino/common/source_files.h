// Which files a compiler takes, and as what: the same for a sketch and for a library.
#pragma once

#include <filesystem>
#include <vector>

namespace qduino::apps {

enum class SourceKind { cpp, c, assembler };

/// .c, .S; anything else is taken for C++.
[[nodiscard]] SourceKind kind_of(const std::filesystem::path& source);

enum class Depth { this_folder, whole_tree };

using IsWanted = bool (*)(const std::filesystem::path&);
/// The regular files in `folder` that are wanted, sorted. Hidden ones, which editors leave behind,
/// are not. None where there is no such folder.
[[nodiscard]] std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder, Depth depth,
                                                          IsWanted is_wanted);

/// The sources among them: .cpp, .cc, .c and .S.
[[nodiscard]] std::vector<std::filesystem::path> sources_in(const std::filesystem::path& folder, Depth depth);

}  // namespace qduino::apps
