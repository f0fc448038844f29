// Reads and writes small files, whole: settings, records, and the kernel's own (/proc, /sys); and
// gives a file or a socket that root has made to the owner of its folder, who is to use it. Not
// real-time.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "base/result.h"

namespace qduino::posix {

/// Reads at most `bytes.size()` bytes from the position of `fd`; 0 at its end. Error: the system's,
/// with `name` as its object.
[[nodiscard]] Result<std::size_t> read_some(int fd, std::span<char> bytes, std::string_view name);

/// The bytes from the position of `fd` to its end. Error: the system's, with `name` as its object.
[[nodiscard]] Result<std::string> read_to_end(int fd, std::string_view name);

/// The whole text of a small file. Error: the system's.
[[nodiscard]] Result<std::string> read_small_file(const std::string& path);

/// Writes all of `bytes`, however little a single write(2) takes. Error: the system's, with `name`
/// as its object.
[[nodiscard]] Result<void> write_all(int fd, std::span<const char> bytes, std::string_view name);

/// One write(2) of `text` to a file that exists: the kernel's files take a value in one piece.
/// Error: the system's.
[[nodiscard]] Result<void> write_small_file(const std::string& path, std::string_view text);

/// Writes `text` to the file at `path`, which is made when it is missing. Error: the system's.
[[nodiscard]] Result<void> write_file(const std::string& path, std::string_view text);

/// Gives `path` to those who use its folder when this process is root; otherwise does nothing. A
/// folder of another user: to its owner and group. A folder of root with another group: the group
/// may read and write it, as its owner may. Gives the open `descriptor` where there is one: a
/// folder's owner could put another file under the name. A socket has none (−1): there a link is
/// not followed. A refusal leaves the file to root.
void give_to_owner_of_folder(const std::filesystem::path& path, int descriptor = -1);

}  // namespace qduino::posix
