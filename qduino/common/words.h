// The words of a command line, in order: the program first.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace qduino::apps {

using Words = std::vector<std::string>;

inline void append(Words& words, const Words& more) { words.insert(words.end(), more.begin(), more.end()); }

/// 16 digits that name a folder in a cache: FNV-1a, 64 bits (Fowler, Noll, Vo). No protection
/// against an attacker.
[[nodiscard]] inline std::string hash_of(const Words& words) {
    std::uint64_t hash = 0xcbf29ce484222325u;
    const auto mix = [&hash](unsigned char byte) { hash = (hash ^ byte) * 0x100000001b3u; };
    for (const std::string& word : words) {
        for (const char c : word) mix(static_cast<unsigned char>(c));
        mix(0);
    }
    char digits[20];
    std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(hash));
    return digits;
}

}  // namespace qduino::apps
