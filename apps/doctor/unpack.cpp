#include "apps/doctor/unpack.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <utility>

#include "posix/small_file.h"
#include "posix/unique_fd.h"

extern char** environ;

namespace qduino::apps::doctor {

std::optional<std::string> unpacked(const std::string& path) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return std::nullopt;
    const posix::UniqueFd output{ends[0]};
    posix::UniqueFd input{ends[1]};
    posix_spawn_file_actions_t files;
    ::posix_spawn_file_actions_init(&files);
    ::posix_spawn_file_actions_adddup2(&files, ends[1], STDOUT_FILENO);
    ::posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    const std::array<const char*, 4> arguments{"gzip", "-dc", path.c_str(), nullptr};
    pid_t child = -1;
    const int failed =
        ::posix_spawnp(&child, "gzip", &files, nullptr, const_cast<char* const*>(arguments.data()), environ);
    ::posix_spawn_file_actions_destroy(&files);
    input.reset();
    Result<std::string> text = posix::read_to_end(output.get(), path);
    int status = 0;
    if (failed != 0 || ::waitpid(child, &status, 0) != child || status != 0 || !text.ok())
        return std::nullopt;
    return std::move(*text);
}

}  // namespace qduino::apps::doctor
