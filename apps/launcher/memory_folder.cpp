#include "apps/launcher/memory_folder.h"

#include <pwd.h>
#include <unistd.h>

#include "apps/launcher/run_lock.h"
#include "posix/system_error.h"

namespace qduino::launcher {
namespace {

namespace fs = std::filesystem;
using posix::system_error;
constexpr std::string_view kPrefix = "qduinomc.";
constexpr const char* kLockName = "lock";

Result<void> give_to(const fs::path& path, const std::string& owner) {
    const passwd* user = ::getpwnam(owner.c_str());
    if (user == nullptr) return make_error(ErrorCode::not_found, "there is no user ", owner);
    if (::chown(path.c_str(), user->pw_uid, user->pw_gid) != 0)
        return system_error("give away", path.native());
    return {};
}

}  // namespace

Result<MemoryFolder> MemoryFolder::make(const fs::path& parent, const std::string& owner) {
    std::string path = (parent / kPrefix).string() + "XXXXXX";
    if (::mkdtemp(path.data()) == nullptr) return system_error("make a folder in", parent.native());
    MemoryFolder folder;
    folder.path_ = path;
    QDUINO_TRY_ASSIGN(folder.lock_, lock_file(folder.file(kLockName), Nanoseconds{0}));
    if (!owner.empty()) QDUINO_TRY(give_to(path, owner));
    return folder;
}

MemoryFolder::~MemoryFolder() {
    std::error_code ignored;
    if (lock_.valid()) fs::remove_all(path_, ignored);
}

int MemoryFolder::sweep(const fs::path& parent) {
    int removed = 0;
    std::error_code error;
    for (fs::directory_iterator at{parent, error}, end; !error && at != end; at.increment(error)) {
        if (!at->path().filename().string().starts_with(kPrefix)) continue;
        // The lock first, then the folder. A folder that is just being made is locked; or its lock
        // is not made yet, and it loses nothing.
        const fs::path lock = at->path() / kLockName;
        std::error_code unreadable;
        if (!fs::exists(lock, unreadable) || !lock_file(lock, Nanoseconds{0})) continue;
        fs::remove_all(at->path(), unreadable);
        removed += unreadable ? 0 : 1;
    }
    return removed;
}

}  // namespace qduino::launcher
