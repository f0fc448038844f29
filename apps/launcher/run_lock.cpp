#include "apps/launcher/run_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <thread>

#include "base/whole_number.h"
#include "board/linux/kernel/clock.h"
#include "posix/acting_as.h"
#include "posix/guarded_file.h"
#include "posix/small_file.h"
#include "posix/system_error.h"

namespace qduino::launcher {
namespace {

namespace fs = std::filesystem;
using posix::system_error;

constexpr Nanoseconds kLookAtLockEvery = 50ms;
constexpr std::string_view kPrefix = "qduinomc.";
constexpr const char* kLockName = "lock";

/// The owner of its folder: he may hold the lock as well.
uid_t owner_of(const fs::path& file) {
    struct stat folder {};
    return ::lstat(file.parent_path().c_str(), &folder) == 0 ? folder.st_uid : posix::kNoOtherOwner;
}

bool is_own_folder(const fs::path& path) {
    struct stat found {};
    return ::lstat(path.c_str(), &found) == 0 && S_ISDIR(found.st_mode) && found.st_uid == ::geteuid();
}

/// Removes a folder in memory. What the service has made in its own folder there is removed by the
/// service's rights: root gave up the right to write in another user's.
bool remove_with_contents(const fs::path& path) {
    std::error_code error;
    for (fs::directory_iterator at{path, error}, end; !error && at != end; at.increment(error)) {
        struct stat found {};
        if (::lstat(at->path().c_str(), &found) != 0 || !S_ISDIR(found.st_mode)) continue;
        const posix::ActingAs owner{found.st_uid, found.st_gid};
        std::error_code unreadable;
        for (fs::directory_iterator in{at->path(), unreadable}; !unreadable && in != end;
             in.increment(unreadable)) {
            std::error_code ignored;
            fs::remove_all(in->path(), ignored);
        }
    }
    fs::remove_all(path, error);
    return !error;
}

bool has_open(const fs::path& process, const fs::path& file) {
    std::error_code error;
    for (fs::directory_iterator at{process / "fd", error}, end; !error && at != end; at.increment(error)) {
        std::error_code unreadable;
        if (fs::read_symlink(at->path(), unreadable) == file) return true;
    }
    return false;
}

}  // namespace

std::vector<Holder> holders_of(const fs::path& file) {
    std::error_code error;
    const fs::path whole = fs::weakly_canonical(file, error);
    std::vector<Holder> holders;
    for (fs::directory_iterator at{"/proc", error}, end; !error && at != end; at.increment(error)) {
        const auto pid = whole_number<int>(at->path().filename().native());
        if (!pid || *pid == ::getpid() || !has_open(at->path(), whole)) continue;
        const auto name = posix::read_small_file(at->path() / "comm");
        holders.push_back({*pid, name ? name->substr(0, name->find('\n')) : ""});
    }
    return holders;
}

std::string names_of(const std::vector<Holder>& holders) {
    std::string names;
    for (const Holder& holder : holders)
        write(names, names.empty() ? "" : ", ", holder.name, " (", holder.pid, ')');
    return names;
}

Result<posix::UniqueFd> lock_file(const fs::path& file, Nanoseconds patience) {
    QDUINO_TRY_ASSIGN(posix::UniqueFd lock, posix::open_or_make_guarded(file, 0600, owner_of(file)));
    ::fcntl(lock.get(), F_SETFD, 0);  // children must hold it, too
    const Instant until = board::linux::monotonic_now() + patience;
    while (::flock(lock.get(), LOCK_EX | LOCK_NB) != 0) {
        if (errno != EWOULDBLOCK && errno != EINTR) return system_error("lock", file.native());
        if (board::linux::monotonic_now() >= until)
            return make_error(ErrorCode::already_exists, "held by ", names_of(holders_of(file)));
        std::this_thread::sleep_for(kLookAtLockEvery);
    }
    return lock;
}

Result<MemoryFolder> MemoryFolder::make(const fs::path& parent, std::optional<gid_t> users) {
    std::string path = (parent / kPrefix).string() + "XXXXXX";
    if (::mkdtemp(path.data()) == nullptr) return system_error("make a folder in", parent.native());
    MemoryFolder folder;
    folder.path_ = path;
    QDUINO_TRY_ASSIGN(folder.lock_, lock_file(folder.file(kLockName), Nanoseconds{0}));
    if (!users) return folder;
    // They may go through it, and reach the single files that are given to them. What is made in it
    // has their group: its makers have not the right to give it. (The mode first: behind the chown
    // the kernel would leave the 02000 out.)
    if (::chmod(path.c_str(), 02710) != 0 || ::chown(path.c_str(), static_cast<uid_t>(-1), *users) != 0)
        return system_error("open for the service", path);
    return folder;
}

MemoryFolder::~MemoryFolder() {
    if (lock_.valid()) static_cast<void>(remove_with_contents(path_));
}

int MemoryFolder::sweep(const fs::path& parent) {
    int removed = 0;
    std::error_code error;
    for (fs::directory_iterator at{parent, error}, end; !error && at != end; at.increment(error)) {
        if (!at->path().filename().string().starts_with(kPrefix)) continue;
        if (!is_own_folder(at->path())) continue;
        // The lock first, then the folder. A folder that is just being made is locked; or its lock
        // is not made yet, and it loses nothing.
        const fs::path lock = at->path() / kLockName;
        std::error_code unreadable;
        if (!fs::exists(lock, unreadable) || !lock_file(lock, Nanoseconds{0})) continue;
        removed += remove_with_contents(at->path()) ? 1 : 0;
    }
    return removed;
}

}  // namespace qduino::launcher
