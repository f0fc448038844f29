#include "rights/own_view.h"

#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::rights {
namespace {

namespace fs = std::filesystem;
using posix::system_error;

/// Any folder that exists will do: it is covered in this view alone.
constexpr const char* kNewRoot = "/tmp";
constexpr unsigned long kHarmless = MS_NOSUID | MS_NODEV | MS_NOEXEC;

/// The place of `path` below the new root, made there: a folder or an empty file.
Result<fs::path> place_for(const fs::path& path, bool is_folder) {
    const fs::path place = kNewRoot + path.native();
    std::error_code failed;
    fs::create_directories(is_folder ? place : place.parent_path(), failed);
    if (failed) return system_error("make", place.native(), failed.value());
    if (is_folder) return place;
    const posix::UniqueFd made{::open(place.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644)};
    if (!made.valid()) return system_error("make", place.native());
    return place;
}

/// `opened` is a folder or a file of the old root, held since before that was covered.
Result<void> show(int opened, const SeenFolder& seen, bool is_folder) {
    QDUINO_TRY_ASSIGN(const fs::path place, place_for(seen.path, is_folder));
    const std::string from = "/proc/self/fd/" + std::to_string(opened);
    if (::mount(from.c_str(), place.c_str(), nullptr, MS_BIND, nullptr) != 0)
        return system_error("show", seen.path.native());
    const unsigned long flags = MS_BIND | MS_REMOUNT | kHarmless | (seen.writable ? 0 : MS_RDONLY);
    if (::mount(nullptr, place.c_str(), nullptr, flags, nullptr) != 0)
        return system_error("protect", seen.path.native());
    return {};
}

/// The new root below kNewRoot, with all that is seen in it.
Result<void> build(std::span<const SeenFolder> folders) {
    std::vector<posix::UniqueFd> opened;
    for (const SeenFolder& seen : folders) opened.emplace_back(::open(seen.path.c_str(), O_PATH | O_CLOEXEC));
    if (::mount("tmpfs", kNewRoot, "tmpfs", kHarmless, "mode=0755,size=1m") != 0)
        return system_error("make", "an empty root");
    for (std::size_t i = 0; i < folders.size(); ++i) {
        struct stat found {};
        if (!opened[i].valid() || ::fstat(opened[i].get(), &found) != 0) continue;
        QDUINO_TRY(show(opened[i].get(), folders[i], S_ISDIR(found.st_mode)));
    }
    return {};
}

}  // namespace

Result<void> see_only(std::vector<SeenFolder> folders) {
    // The outer before the inner, which it would cover.
    std::ranges::sort(folders, {}, &SeenFolder::path);
    if (::unshare(CLONE_NEWNS) != 0) return system_error("make", "a view of the files of its own");
    // Nothing that is mounted here shows elsewhere.
    if (::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0)
        return system_error("separate", "the view of the files");
    const mode_t before = ::umask(022);  // the way to the folders is everybody's
    const Result<void> built = build(folders);
    ::umask(before);
    if (!built) {
        ::umount2(kNewRoot, MNT_DETACH);  // the view is as it was
        return built;
    }
    if (::chdir(kNewRoot) != 0 || ::syscall(SYS_pivot_root, ".", ".") != 0 ||
        ::umount2(".", MNT_DETACH) != 0 || ::chdir("/") != 0)
        return system_error("enter", "the view of the files of its own");
    if (::mount(nullptr, "/", nullptr, MS_REMOUNT | MS_BIND | MS_RDONLY | kHarmless, nullptr) != 0)
        return system_error("protect", "the view of the files of its own");
    return {};
}

Result<void> leave_network() {
    return ::unshare(CLONE_NEWNET) == 0 ? Result<void>{} : system_error("leave", "the network");
}

}  // namespace qduino::rights
