#include "board/linux/kernel/shared_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>

#include "base/text.h"
#include "board/linux/kernel/kernel_text.h"
#include "posix/guarded_file.h"

namespace qduino::board::linux {

using posix::UniqueFd;

namespace {

constexpr const char* kRootsRegister = "/run/qduino";

/// A user's folder for run-time files, which systemd makes at his login (XDG Base Directory
/// Specification): his alone.
std::string folder_of_login(const std::string& root) {
    const auto folder = text<std::string>(root, "/run/user/", ::geteuid());
    struct stat found {};
    const bool his = ::lstat(folder.c_str(), &found) == 0 && S_ISDIR(found.st_mode) &&
                     found.st_uid == ::geteuid() && (found.st_mode & 0077) == 0;
    return his ? folder : std::string{};
}

struct flock whole_file(short type) {
    struct flock lock {};
    lock.l_type = type;
    lock.l_whence = SEEK_SET;
    return lock;
}

}  // namespace

Result<std::string> own_register(const std::string& root) {
    std::vector<std::pair<std::string, mode_t>> places;
    if (::geteuid() == 0) {
        places.emplace_back(root + kRootsRegister, 0755);
    } else {
        if (const std::string login = folder_of_login(root); !login.empty())
            places.emplace_back(login + "/qduino", 0700);
        for (const char* folder : {"/dev/shm", "/tmp"})
            places.emplace_back(text<std::string>(root, folder, "/qduino-", ::geteuid()), 0700);
    }
    std::string why;
    for (const auto& [folder, mode] : places) {
        const Result<void> made = posix::make_own_folder(folder, mode);
        if (made) return folder;
        write(why, why.empty() ? "" : "; ", made.error().message);
    }
    return make_error(ErrorCode::not_permitted, "no folder for the registers of cores: ", why);
}

std::vector<std::string> believed_registers(const std::string& root, const std::string& own) {
    std::vector<std::string> folders{own};
    if (own != root + kRootsRegister) folders.push_back(root + kRootsRegister);
    return folders;
}

bool lock_whole(int file) {
    struct flock lock = whole_file(F_WRLCK);
    return ::fcntl(file, F_OFD_SETLK, &lock) == 0;
}

// Asked as a reader: only a write lock stands in a reader's way.
bool is_locked(int file) {
    struct flock lock = whole_file(F_RDLCK);
    return ::fcntl(file, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

bool is_still_named(int file, const std::string& path) {
    struct stat here {
    }, there{};
    return ::fstat(file, &here) == 0 && ::lstat(path.c_str(), &there) == 0 && here.st_ino == there.st_ino &&
           here.st_dev == there.st_dev;
}

HeldFile& HeldFile::operator=(HeldFile&& other) noexcept {
    if (this == &other) return *this;
    release();
    path_ = std::move(other.path_);
    file_ = std::move(other.file_);
    return *this;
}

void HeldFile::release() {
    if (file_.valid() && is_still_named(file_.get(), path_)) ::unlink(path_.c_str());
    file_.reset();
}

std::string printable(std::string_view raw, std::size_t longest) {
    std::string text{trimmed(raw)};
    std::ranges::replace_if(
        text, [](unsigned char c) { return std::isprint(c) == 0; }, ' ');
    if (text.size() > longest) text = text.substr(0, longest - 3) + "...";
    return text;
}

}  // namespace qduino::board::linux
