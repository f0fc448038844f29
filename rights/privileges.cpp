#include "rights/privileges.h"

#include <grp.h>
#include <pwd.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "posix/acting_as.h"
#include "posix/ends_with_parent.h"
#include "posix/guarded_file.h"
#include "posix/system_error.h"
#include "rights/rights.h"
#include "rights/state_folder.h"

namespace qduino::rights {

Result<posix::UniqueFd> lock_state(const std::filesystem::path& folder) {
    std::error_code failed;
    if (!std::filesystem::exists(folder, failed)) {
        std::filesystem::create_directories(folder, failed);
        if (!failed) std::filesystem::permissions(folder, std::filesystem::perms::owner_all, failed);
    }
    if (failed) return posix::system_error("make the state folder", folder.native(), failed.value());
    struct stat owner {};
    if (::lstat(folder.c_str(), &owner) != 0) return posix::system_error("look at", folder.native());
    Result<posix::UniqueFd> opened = [&] {
        const posix::ActingAs him{owner.st_uid, owner.st_gid};
        return posix::open_or_make_guarded(folder / "lock", 0600, owner.st_uid);
    }();
    if (!opened) return opened.error();
    posix::UniqueFd lock = std::move(*opened);
    if (::flock(lock.get(), LOCK_EX | LOCK_NB) == 0) return lock;
    return make_error(ErrorCode::already_exists, "a print service is already running with ", folder.native());
}

Result<void> become(const std::string& user, const std::filesystem::path& state,
                    const std::function<void()>& last_as_root) {
    if (::geteuid() != 0) return make_error(ErrorCode::not_permitted, "--run-as needs root to begin with");
    const passwd* entry = ::getpwnam(user.c_str());
    if (!entry) return make_error(ErrorCode::not_found, "--run-as: there is no user ", user);
    const passwd found = *entry;
    if (found.pw_uid == 0) return make_error(ErrorCode::not_permitted, "--run-as: ", user, " is root");
    std::array<gid_t, 64> groups{};  // the first ones, where there are more
    int count = static_cast<int>(groups.size());
    ::getgrouplist(user.c_str(), found.pw_gid, groups.data(), &count);
    count = std::min(count, static_cast<int>(groups.size()));
    QDUINO_TRY(hand_over_state(state, found.pw_uid, found.pw_gid));
    if (last_as_root) last_as_root();
    const posix::EndsWithParent kept;
    QDUINO_TRY(bound_capabilities({}));
    if (::setgroups(static_cast<std::size_t>(count), groups.data()) != 0 || ::setgid(found.pw_gid) != 0 ||
        ::setuid(found.pw_uid) != 0) {
        return posix::system_error("become", user);
    }
    if (::setuid(0) == 0) return make_error(ErrorCode::internal, "--run-as: root could be had back");
    QDUINO_TRY(refuse_system_calls());
    if (::access(state.c_str(), R_OK | W_OK | X_OK) == 0) return {};
    return make_error(ErrorCode::not_permitted, "user ", user, " cannot reach ", state.native(),
                      "; choose another --state, /var/lib/qduinomc for one");
}

std::string owner_of(const std::filesystem::path& folder) {
    struct stat found {};
    if (::lstat(folder.c_str(), &found) != 0 || found.st_uid == 0) return {};
    const passwd* owner = ::getpwuid(found.st_uid);
    return owner ? owner->pw_name : std::string{};
}

}  // namespace qduino::rights
