// Reads what the kernel shows as text: words, lines and lists in small files, and folders of them.
// Not real-time.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/parts.h"
#include "base/whole_number.h"
#include "posix/small_file.h"

namespace qduino::board::linux {

/// Without the blanks, line ends and zeros at its end.
inline std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kBlank{" \t\n\0", 4};
    return text.substr(0, text.find_last_not_of(kBlank) + 1);
}

/// What stands between blanks and line ends.
inline std::vector<std::string_view> words(std::string_view text) { return parts(text, " \t\n"); }

/// The fields of a /proc/…/stat behind the task's name, which may hold anything: the first is field
/// 3 of proc_pid_stat(5).
inline std::vector<std::string_view> stat_fields(std::string_view stat) {
    return words(stat.substr(stat.rfind(')') + 1));
}

/// The text of a file, trimmed; empty when it cannot be read.
inline std::string text_of_file(const std::string& path) {
    const auto text = posix::read_small_file(path);
    return text ? std::string{trimmed(*text)} : std::string{};
}

/// Compares a release as in /proc/sys/kernel/osrelease, "6.1.0-50-rt-amd64". False when it does not
/// begin with numbers.
inline bool release_at_least(std::string_view release, int major, int minor) {
    const auto first = whole_number<int>(cut(release, '.'));
    const auto second = whole_number<int>(release.substr(0, release.find_first_not_of("0123456789")));
    return first && second && std::pair{*first, *second} >= std::pair{major, minor};
}

/// The entries of a folder, in order of name; none when it is not there.
inline std::vector<std::string> entries(const std::string& folder) {
    std::vector<std::string> names;
    std::error_code error;
    for (std::filesystem::directory_iterator at{folder, error}, end; !error && at != end; at.increment(error))
        names.push_back(at->path().filename().string());
    std::ranges::sort(names);
    return names;
}

}  // namespace qduino::board::linux
