#include "board/linux/core_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <ctime>
#include <optional>
#include <sstream>
#include <utility>

#include "board/linux/clock.h"
#include "board/linux/machine_settings.h"
#include "posix/small_file.h"
#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

using posix::read_small_file;
using posix::system_error;
using posix::UniqueFd;
namespace {

constexpr Nanoseconds kLookAgain = 20ms;
constexpr std::size_t kCommandShown = 60;

/// The first folder in which every user may make files; else the first in which this process may.
/// Empty: none.
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

/// Opens the file if it is there, else makes it, for all users. (In a folder with the sticky bit,
/// O_CREAT must not be used on another user's file.)
UniqueFd open_or_make(const std::string& path) {
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

/// True while `path` still names this file: a holder that left has removed it.
bool is_current(int file, const std::string& path) {
    struct stat here {
    }, there{};
    return ::fstat(file, &here) == 0 && ::lstat(path.c_str(), &there) == 0 && here.st_ino == there.st_ino &&
           here.st_dev == there.st_dev;
}

/// Printable, one line, of bounded length: others may have written it.
std::string tidy(std::string text, std::size_t longest) {
    while (!text.empty() && (text.back() == '\0' || text.back() == '\n')) text.pop_back();
    for (char& c : text) {
        if (std::isprint(static_cast<unsigned char>(c)) == 0) c = ' ';
    }
    if (text.size() > longest) text = text.substr(0, longest - 3) + "...";
    return text;
}

/// Without the folder of its program, which is long and says little.
std::string command_of(const std::string& pid) {
    const auto text = read_small_file("/proc/" + pid + "/cmdline");
    if (!text) return {};
    const std::size_t slash = text->substr(0, text->find('\0')).rfind('/');
    return tidy(slash == std::string::npos ? *text : text->substr(slash + 1), 200);
}

std::string program_of(const std::string& pid) {
    const auto text = read_small_file("/proc/" + pid + "/comm");
    return text ? tidy(*text, 15) : std::string{};
}

struct Holder {
    std::string pid, since, program, command;
};

/// The words of the holder. It may be writing them just now: then some are empty.
Holder read_holder(int file) {
    std::array<char, 512> bytes{};
    const ssize_t count = ::pread(file, bytes.data(), bytes.size(), 0);
    std::istringstream lines{
        std::string{bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0))}};
    Holder holder;
    for (std::string key, value; lines >> key && std::getline(lines >> std::ws, value);) {
        if (key == "pid" && value.find_first_not_of("0123456789") == std::string::npos)
            holder.pid = tidy(value, 10);
        if (key == "since") holder.since = tidy(value, 24);
        if (key == "program") holder.program = tidy(value, 15);
        if (key == "command") holder.command = tidy(value, kCommandShown);
    }
    return holder;
}

Error taken(int core, const Holder& holder) {
    const std::string number = std::to_string(core);
    std::string text = "core " + number + " is taken: ";
    if (holder.pid.empty()) {
        text += "another sketch owns it";
    } else {
        text += (holder.program.empty() ? "a sketch" : holder.program) + " (pid " + holder.pid +
                ") owns it since " + holder.since + ", started as `" + holder.command + "`";
    }
    return make_error(ErrorCode::unavailable, text + ": stop that one, or give the loop another core");
}

}  // namespace

CoreLock& CoreLock::operator=(CoreLock&& other) noexcept {
    if (this == &other) return *this;
    release();
    path_ = std::move(other.path_);
    file_ = std::move(other.file_);
    return *this;
}

Result<CoreLock> CoreLock::take(int core, Nanoseconds patience, const std::string& root) {
    const std::string folder = shared_folder(root);
    if (folder.empty()) {
        return make_error(ErrorCode::not_permitted,
                          "no folder for a lock of core " + std::to_string(core) +
                              ": neither /run/lock nor /dev/shm nor /tmp is writable");
    }
    const std::string path = folder + "/qduino-core" + std::to_string(core) + ".lock";
    const Instant until = monotonic_now() + patience;
    for (;;) {
        UniqueFd file = open_or_make(path);
        struct stat status {};
        if (!file.valid() || ::fstat(file.get(), &status) != 0) return system_error("open", path);
        if (!S_ISREG(status.st_mode))
            return make_error(ErrorCode::not_permitted, path + " is no file: remove it");
        if (::flock(file.get(), LOCK_EX | LOCK_NB) == 0) {
            if (!is_current(file.get(), path)) continue;
            CoreLock lock;
            lock.path_ = path;
            lock.file_ = std::move(file);
            lock.write_holder();
            return lock;
        }
        if (errno != EWOULDBLOCK) return system_error("lock", path);
        if (monotonic_now() >= until) return taken(core, read_holder(file.get()));
        block_until(monotonic_now() + kLookAgain);
    }
}

void CoreLock::write_holder() const {
    const std::string pid = std::to_string(::getpid());
    const std::time_t now = std::time(nullptr);
    std::tm utc{};
    ::gmtime_r(&now, &utc);
    std::array<char, 32> since{};
    std::strftime(since.data(), since.size(), "%Y-%m-%d %H:%M:%S UTC", &utc);
    const std::string text = "pid " + pid + "\nsince " + since.data() + "\nprogram " + program_of(pid) +
                             "\ncommand " + command_of(pid) + "\n";
    // For people alone: if they cannot be written (another user's file), a message lacks them.
    static_cast<void>(::ftruncate(file_.get(), 0) == 0 &&
                      ::pwrite(file_.get(), text.data(), text.size(), 0) > 0);
}

void CoreLock::release() {
    if (file_.valid() && is_current(file_.get(), path_)) ::unlink(path_.c_str());
    file_.reset();
}

}  // namespace qduino::board::linux
