// The version of the running kernel, for what depends on it.
#pragma once

#include <cstdio>
#include <string>

namespace qduino::board::linux {

/// Compares a release as in /proc/sys/kernel/osrelease, "6.1.0-50-rt-amd64". False when it does not
/// begin with numbers.
inline bool release_at_least(const std::string& release, int major, int minor) {
    int found_major = 0;
    int found_minor = 0;
    if (std::sscanf(release.c_str(), "%d.%d", &found_major, &found_minor) != 2) return false;
    return found_major != major ? found_major > major : found_minor >= minor;
}

}  // namespace qduino::board::linux
