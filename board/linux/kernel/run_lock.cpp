#include "board/linux/kernel/run_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <thread>

#include "base/whole_number.h"
#include "board/linux/kernel/clock.h"
#include "posix/guarded_file.h"
#include "posix/small_file.h"
#include "posix/system_error.h"

namespace qduino::board::linux {
namespace {

namespace fs = std::filesystem;

constexpr Nanoseconds kLookAtLockEvery = 50ms;

/// The owner of its folder: he may hold the lock as well.
uid_t owner_of(const fs::path& file) {
    struct stat folder {};
    return ::lstat(file.parent_path().c_str(), &folder) == 0 ? folder.st_uid : posix::kNoOtherOwner;
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

std::vector<LockHolder> holders_of(const fs::path& file) {
    std::error_code error;
    const fs::path whole = fs::weakly_canonical(file, error);
    std::vector<LockHolder> holders;
    for (fs::directory_iterator at{"/proc", error}, end; !error && at != end; at.increment(error)) {
        const auto pid = whole_number<int>(at->path().filename().native());
        if (!pid || *pid == ::getpid() || !has_open(at->path(), whole)) continue;
        const auto name = posix::read_small_file(at->path() / "comm");
        holders.push_back({*pid, name ? name->substr(0, name->find('\n')) : ""});
    }
    return holders;
}

std::string names_of(const std::vector<LockHolder>& holders) {
    std::string names;
    for (const LockHolder& holder : holders)
        write(names, names.empty() ? "" : ", ", holder.name, " (", holder.pid, ')');
    return names;
}

Result<posix::UniqueFd> lock_file(const fs::path& file, Nanoseconds patience) {
    QDUINO_TRY_ASSIGN(posix::UniqueFd lock, posix::open_or_make_guarded(file, 0600, owner_of(file)));
    ::fcntl(lock.get(), F_SETFD, 0);  // children must hold it, too
    const Instant until = monotonic_now() + patience;
    while (::flock(lock.get(), LOCK_EX | LOCK_NB) != 0) {
        if (errno != EWOULDBLOCK && errno != EINTR) return posix::system_error("lock", file.native());
        if (monotonic_now() >= until)
            return make_error(ErrorCode::already_exists, "held by ", names_of(holders_of(file)));
        std::this_thread::sleep_for(kLookAtLockEvery);
    }
    return lock;
}

}  // namespace qduino::board::linux
