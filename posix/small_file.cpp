#include "posix/small_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>

#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::posix {

Result<std::size_t> read_some(int fd, std::span<char> bytes, std::string_view name) {
    for (;;) {
        const ssize_t count = ::read(fd, bytes.data(), bytes.size());
        if (count >= 0) return static_cast<std::size_t>(count);
        if (errno != EINTR) return system_error("read", name);
    }
}

Result<std::string> read_to_end(int fd, std::string_view name) {
    std::string text;
    std::array<char, 4096> part;
    for (;;) {
        QDUINO_TRY_ASSIGN(const std::size_t count, read_some(fd, part, name));
        if (count == 0) return text;
        text.append(part.data(), count);
    }
}

Result<std::string> read_small_file(const std::string& path) {
    const UniqueFd file{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
    if (!file.valid()) return system_error("open", path);
    return read_to_end(file.get(), path);
}

Result<void> write_all(int fd, std::span<const char> bytes, std::string_view name) {
    while (!bytes.empty()) {
        const ssize_t count = ::write(fd, bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) return system_error("write", name);
        bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
    return {};
}

Result<void> write_small_file(const std::string& path, std::string_view text) {
    const UniqueFd file{::open(path.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC)};
    if (!file.valid()) return system_error("open", path);
    if (::write(file.get(), text.data(), text.size()) < 0) return system_error("write", path);
    return {};
}

Result<void> write_file(const std::string& path, std::string_view text) {
    const UniqueFd file{::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)};
    if (!file.valid()) return system_error("open", path);
    return write_all(file.get(), text, path);
}

namespace {

/// Nobody else can swap what has a name in a folder of root.
void give_to_group(const std::filesystem::path& path, int descriptor, gid_t group) {
    struct stat found {};
    if ((descriptor >= 0 ? ::fstat(descriptor, &found) : ::lstat(path.c_str(), &found)) != 0) return;
    if (S_ISLNK(found.st_mode)) return;
    const mode_t mode = (found.st_mode & 0707) | (found.st_mode & 0700) >> 3;
    // In a folder whose files get its group (02710) this takes no right of root.
    const bool is_its = found.st_gid == group;
    constexpr uid_t kSame = static_cast<uid_t>(-1);
    if (descriptor >= 0) {
        static_cast<void>((is_its || ::fchown(descriptor, kSame, group) == 0) &&
                          ::fchmod(descriptor, mode) == 0);
    } else {
        static_cast<void>((is_its || ::lchown(path.c_str(), kSame, group) == 0) &&
                          ::chmod(path.c_str(), mode) == 0);
    }
}

}  // namespace

void give_to_owner_of_folder(const std::filesystem::path& path, int descriptor) {
    struct stat folder {};
    const std::filesystem::path parent = path.has_parent_path() ? path.parent_path() : ".";
    if (::geteuid() != 0 || ::stat(parent.c_str(), &folder) != 0) return;
    if (folder.st_uid == 0) {
        if (folder.st_gid != 0) give_to_group(path, descriptor, folder.st_gid);
        return;
    }
    const int given = descriptor >= 0 ? ::fchown(descriptor, folder.st_uid, folder.st_gid)
                                      : ::lchown(path.c_str(), folder.st_uid, folder.st_gid);
    static_cast<void>(given);
}

}  // namespace qduino::posix
