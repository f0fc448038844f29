#include "apps/doctor/unpack.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>

extern char** environ;

namespace qduino::apps::doctor {

std::optional<std::string> unpacked(const std::string& path) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return std::nullopt;
    posix_spawn_file_actions_t files;
    ::posix_spawn_file_actions_init(&files);
    ::posix_spawn_file_actions_adddup2(&files, ends[1], STDOUT_FILENO);
    ::posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    const std::array<const char*, 4> arguments{"gzip", "-dc", path.c_str(), nullptr};
    pid_t child = -1;
    const int failed =
        ::posix_spawnp(&child, "gzip", &files, nullptr, const_cast<char* const*>(arguments.data()), environ);
    ::posix_spawn_file_actions_destroy(&files);
    ::close(ends[1]);
    std::string text;
    std::array<char, 4096> part;
    for (ssize_t bytes = 0; failed == 0 && (bytes = ::read(ends[0], part.data(), part.size())) > 0;) {
        text.append(part.data(), static_cast<std::size_t>(bytes));
    }
    ::close(ends[0]);
    int status = 0;
    if (failed != 0 || ::waitpid(child, &status, 0) != child || status != 0) return std::nullopt;
    return text;
}

}  // namespace qduino::apps::doctor
