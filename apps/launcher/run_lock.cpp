#include "apps/launcher/run_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <thread>

#include "base/whole_number.h"
#include "board/linux/clock.h"
#include "posix/small_file.h"
#include "posix/system_error.h"

namespace qduino::launcher {
namespace {

namespace fs = std::filesystem;
constexpr Nanoseconds kLookEvery = 50ms;

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
    // Without O_CLOEXEC: children must hold it, too.
    posix::UniqueFd lock{::open(file.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW, 0600)};
    if (!lock.valid()) return posix::system_error("open", file.native());
    const Instant until = board::linux::monotonic_now() + patience;
    while (::flock(lock.get(), LOCK_EX | LOCK_NB) != 0) {
        if (errno != EWOULDBLOCK && errno != EINTR) return posix::system_error("lock", file.native());
        if (board::linux::monotonic_now() >= until)
            return make_error(ErrorCode::already_exists, "held by ", names_of(holders_of(file)));
        std::this_thread::sleep_for(kLookEvery);
    }
    return lock;
}

}  // namespace qduino::launcher
