#include "board/linux/kernel/memory_folder.h"

#include <sys/stat.h>
#include <unistd.h>

#include "board/linux/kernel/run_lock.h"
#include "posix/acting_as.h"
#include "posix/system_error.h"

namespace qduino::board::linux {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "qduinomc.";
constexpr const char* kLockName = "lock";

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

}  // namespace

Result<MemoryFolder> MemoryFolder::make(const fs::path& parent, std::optional<gid_t> users) {
    std::string path = (parent / kPrefix).string() + "XXXXXX";
    if (::mkdtemp(path.data()) == nullptr) return posix::system_error("make a folder in", parent.native());
    MemoryFolder folder;
    folder.path_ = path;
    QDUINO_TRY_ASSIGN(folder.lock_, lock_file(folder.file(kLockName), Nanoseconds{0}));
    if (!users) return folder;
    // They may go through it, and reach the single files that are given to them. What is made in it
    // has their group: its makers have not the right to give it. (The mode first: behind the chown
    // the kernel would leave the 02000 out.)
    if (::chmod(path.c_str(), 02710) != 0 || ::chown(path.c_str(), static_cast<uid_t>(-1), *users) != 0)
        return posix::system_error("open for the service", path);
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

}  // namespace qduino::board::linux
