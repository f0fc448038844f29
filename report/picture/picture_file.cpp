#include "report/picture/picture_file.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "posix/small_file.h"
#include "posix/unique_fd.h"

extern char** environ;

namespace qduino::apps::picture {
namespace {

constexpr const char* kConverter = "rsvg-convert";

bool is_png(const std::string& path) { return path.ends_with(".png"); }

bool is_on_path(const std::string& program) {
    const char* const path = std::getenv("PATH");
    std::istringstream folders(path ? path : "");
    for (std::string folder; std::getline(folders, folder, ':');) {
        if (::access((folder + "/" + program).c_str(), X_OK) == 0) return true;
    }
    return false;
}

/// Runs the converter with the page as its standard input. Returns its exit status, or -1.
int convert(int page, const std::string& path) {
    const char* const words[] = {kConverter, "--format=png", "--zoom=2", "--output", path.c_str(), nullptr};
    posix_spawn_file_actions_t files;
    ::posix_spawn_file_actions_init(&files);
    ::posix_spawn_file_actions_adddup2(&files, page, STDIN_FILENO);
    pid_t child = 0;
    const int failed =
        ::posix_spawnp(&child, kConverter, &files, nullptr, const_cast<char**>(words), environ);
    ::posix_spawn_file_actions_destroy(&files);
    if (failed != 0) return -1;
    int status = 0;
    while (::waitpid(child, &status, 0) < 0) {
        if (errno != EINTR) return -1;
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

Result<void> check_picture_name(const std::string& path) {
    if (path.ends_with(".svg")) return {};
    if (!is_png(path)) {
        return make_error(ErrorCode::invalid_argument,
                          "a picture's name ends in .svg (or .png), and this does not: ", path);
    }
    if (is_on_path(kConverter)) return {};
    return make_error(
        ErrorCode::not_found,
        "for a .png, rsvg-convert is needed (Debian: librsvg2-bin), and it is not on the PATH: take a "
        "name that ends in .svg, which every browser shows. Not written: ",
        path);
}

Result<void> write_picture(const std::string& path, const std::string& svg) {
    QDUINO_TRY(check_picture_name(path));
    if (!is_png(path)) {
        if (const Result<void> written = posix::write_file(path, svg); !written)
            return make_error(ErrorCode::unavailable, "the picture cannot be written to ", path, ": ",
                              written.error().message.view());
        return {};
    }
    const posix::UniqueFd page{::memfd_create("qduino-picture", MFD_CLOEXEC)};
    if (!page.valid()) return make_error(ErrorCode::unavailable, "no memory for the picture");
    QDUINO_TRY(posix::write_all(page.get(), svg, "the picture"));
    ::lseek(page.get(), 0, SEEK_SET);
    if (convert(page.get(), path) == 0) return {};
    return make_error(ErrorCode::unavailable, "rsvg-convert could not write ", path,
                      ": see what it said above, or take a name that ends in .svg");
}

}  // namespace qduino::apps::picture
