// Small files, whole: settings, records, and the files by which the kernel speaks (/proc, /sys). Not real-time.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "base/result.h"

namespace qduino::posix {

/// At most `bytes.size()` bytes from where `fd` stands; 0 at its end. Error: the system's, in which `name` is the object.
[[nodiscard]] Result<std::size_t> read_some(int fd, std::span<char> bytes, std::string_view name);

/// The bytes from where `fd` stands to its end. Error: the system's, in which `name` is the object.
[[nodiscard]] Result<std::string> read_to_end(int fd, std::string_view name);

/// The whole text of a small file. Error: the system's.
[[nodiscard]] Result<std::string> read_small_file(const std::string& path);

/// All of `bytes`, whatever a single write(2) takes. Error: the system's, in which `name` is the object.
[[nodiscard]] Result<void> write_all(int fd, std::span<const char> bytes, std::string_view name);

/// One write(2) of `text` to a file that exists: the kernel's files take a value in one piece. Error: the system's.
[[nodiscard]] Result<void> write_small_file(const std::string& path, std::string_view text);

}  // namespace qduino::posix
