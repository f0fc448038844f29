#include "posix/guarded_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/text.h"
#include "posix/small_file.h"
#include "posix/system_error.h"

namespace qduino::posix {
namespace {

constexpr int kFlags = O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC;
/// Two programs that make and remove the same name may meet a few times.
constexpr int kAttempts = 100;

Error refused(const std::filesystem::path& path, std::string_view why) {
    return make_error(ErrorCode::not_permitted, path.native(), " is not used: ", why);
}

/// open(2) says of a link ELOOP: a person wants to read what that is.
Error open_error(const std::filesystem::path& path) {
    if (errno == ELOOP) return refused(path, "it is a symbolic link");
    if (errno == ENXIO) return refused(path, "it is a FIFO, a socket or a device");
    return system_error("open", path.native());
}

Result<void> check(const struct stat& found, const std::filesystem::path& path, uid_t also) {
    if (!S_ISREG(found.st_mode)) return refused(path, "it is not a plain file");
    if (found.st_uid != 0 && found.st_uid != ::geteuid() && (also == kNoOtherOwner || found.st_uid != also))
        return refused(path, "it belongs to another user");
    if (found.st_nlink > 1) return refused(path, "the file has a second name (a hard link)");
    return {};
}

}  // namespace

Result<UniqueFd> open_guarded(const std::filesystem::path& path, int access, uid_t also) {
    UniqueFd file{::open(path.c_str(), access | kFlags)};
    if (!file.valid()) return open_error(path);
    struct stat found {};
    if (::fstat(file.get(), &found) != 0) return system_error("look at", path.native());
    QDUINO_TRY(check(found, path, also));
    return file;
}

Result<std::string> read_at_most(int fd, std::size_t bytes_max, const std::filesystem::path& path) {
    struct stat found {};
    if (::fstat(fd, &found) != 0) return system_error("look at", path.native());
    if (static_cast<std::uintmax_t>(found.st_size) > bytes_max)
        return refused(path, text("it has more than ", bytes_max, " bytes").view());
    // It may grow meanwhile: no more than that is read.
    std::string bytes(static_cast<std::size_t>(found.st_size), '\0');
    std::size_t have = 0;
    while (have < bytes.size()) {
        const ssize_t count = ::pread(fd, bytes.data() + have, bytes.size() - have, static_cast<off_t>(have));
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) return system_error("read", path.native());
        if (count == 0) break;
        have += static_cast<std::size_t>(count);
    }
    bytes.resize(have);
    return bytes;
}

Result<std::string> read_guarded(const std::filesystem::path& path, std::size_t bytes_max, uid_t also) {
    QDUINO_TRY_ASSIGN(const UniqueFd file, open_guarded(path, O_RDONLY, also));
    return read_at_most(file.get(), bytes_max, path);
}

Result<UniqueFd> make_guarded(const std::filesystem::path& path, mode_t mode) {
    UniqueFd file{::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | kFlags, mode)};
    if (!file.valid()) return system_error("create", path.native());
    if (::fchmod(file.get(), mode) != 0) return system_error("create", path.native());
    return file;
}

Result<UniqueFd> open_or_make_guarded(const std::filesystem::path& path, mode_t mode, uid_t also) {
    Result<UniqueFd> file = open_guarded(path, O_RDWR, also);
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
        if (file || file.error().code != ErrorCode::not_found) return file;
        file = make_guarded(path, mode);
        if (file || file.error().code != ErrorCode::already_exists) return file;
        file = open_guarded(path, O_RDWR, also);
    }
    return file;
}

Result<void> replace_guarded(const std::filesystem::path& path, std::string_view bytes, mode_t mode) {
    const std::filesystem::path beside =
        path.parent_path() / text<std::string>('.', path.filename().native(), ".new.", ::getpid());
    ::unlink(beside.c_str());
    QDUINO_TRY_ASSIGN(const UniqueFd file, make_guarded(beside, mode));
    Result<void> done = write_all(file.get(), bytes, beside.native());
    if (done && ::rename(beside.c_str(), path.c_str()) != 0) done = system_error("rename", beside.native());
    if (!done) ::unlink(beside.c_str());
    return done;
}

Result<UniqueFd> open_folder_guarded(const std::filesystem::path& path) {
    UniqueFd folder{::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC)};
    if (folder.valid()) return folder;
    if (errno == ELOOP || errno == ENOTDIR) return refused(path, "it is not a folder");
    return system_error("open", path.native());
}

Result<void> make_own_folder(const std::filesystem::path& path, mode_t mode) {
    const bool made = ::mkdir(path.c_str(), mode) == 0;
    if (!made && errno != EEXIST) return system_error("make the folder", path.native());
    QDUINO_TRY_ASSIGN(const UniqueFd folder, open_folder_guarded(path));
    struct stat found {};
    if (::fstat(folder.get(), &found) != 0) return system_error("look at", path.native());
    if (found.st_uid != ::geteuid()) return refused(path, "it belongs to another user");
    // The umask may have taken from the mode; others' right to write is never left.
    if ((found.st_mode & 0777) != mode && ::fchmod(folder.get(), mode) != 0)
        return system_error("close", path.native());
    return {};
}

}  // namespace qduino::posix
