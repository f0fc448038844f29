#include "board/linux/kernel/closed_folder.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>

#include "posix/system_error.h"

namespace qduino::board::linux {
namespace {

/// Another program may close the folder that both have opened.
constexpr int kAttempts = 10;

bool is_ours(const std::string& folder, struct stat& found) {
    return ::stat(folder.c_str(), &found) == 0 && found.st_uid == ::geteuid();
}

/// `change()`, 0 or −1 and errno; again with its folder opened, if permission is all that it lacks.
template <typename Change>
int changed_in(const std::string& folder, Change change) {
    int done = change();
    for (int attempt = 0; done != 0 && errno == EACCES && attempt < kAttempts; ++attempt) {
        struct stat before {};
        if (!is_ours(folder, before) || ::chmod(folder.c_str(), (before.st_mode & 07777) | S_IWUSR) != 0) {
            errno = EACCES;
            return done;
        }
        done = change();
        const int why = errno;
        if ((before.st_mode & S_IWUSR) == 0) ::chmod(folder.c_str(), before.st_mode & 07777);
        errno = why;
    }
    return done;
}

std::string parent_of(const std::string& path) { return std::filesystem::path{path}.parent_path(); }

}  // namespace

bool takes_folders(const std::string& folder) {
    if (::access(folder.c_str(), W_OK) == 0) return true;
    struct stat found {};
    return errno == EACCES && is_ours(folder, found) && S_ISDIR(found.st_mode);
}

Result<void> make_folder_in_closed(const std::string& path) {
    if (changed_in(parent_of(path), [&] { return ::mkdir(path.c_str(), 0755); }) == 0) return {};
    return posix::system_error("make", path);
}

Result<void> remove_folder_in_closed(const std::string& path) {
    if (changed_in(parent_of(path), [&] { return ::rmdir(path.c_str()); }) == 0) return {};
    return posix::system_error("remove", path);
}

}  // namespace qduino::board::linux
