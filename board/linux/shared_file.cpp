#include "board/linux/shared_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>

#include "board/linux/kernel_text.h"

namespace qduino::board::linux {

using posix::UniqueFd;

std::string shared_folder(const std::string& root) {
    std::string ours;
    for (const char* name : {"/run/lock", "/dev/shm", "/tmp"}) {
        const std::string folder = root + name;
        struct stat status {};
        if (::stat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode)) continue;
        if (::access(folder.c_str(), W_OK | X_OK) != 0) continue;
        if ((status.st_mode & S_IWOTH) != 0) return folder;
        if (ours.empty()) ours = folder;
    }
    return ours;
}

// In a folder with the sticky bit, O_CREAT must not be used on another user's file.
UniqueFd open_shared_file(const std::string& path) {
    constexpr int kFlags = O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK;
    for (int attempt = 0; attempt < 100; ++attempt) {
        UniqueFd file{::open(path.c_str(), O_RDWR | kFlags)};
        if (!file.valid() && errno == EACCES) file.reset(::open(path.c_str(), O_RDONLY | kFlags));
        if (file.valid() || errno != ENOENT) return file;
        file.reset(::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | kFlags, 0666));
        if (file.valid()) static_cast<void>(::fchmod(file.get(), 0666));  // whatever the umask
        if (file.valid() || errno != EEXIST) return file;
    }
    return {};
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
