#include "rights/state_folder.h"

#include <dirent.h>
#include <fcntl.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "posix/guarded_file.h"
#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::rights {
namespace {

using posix::system_error;
using posix::UniqueFd;

/// What the programs of the printer keep at the top of the folder. A name that ends in '*' stands
/// for all that begin so.
constexpr std::array<std::string_view, 18> kOurs{"lock",           "run.lock",
                                                 "address",        "api-key*",
                                                 "serial",         "journal.*",
                                                 "blobs",          "blobs-journal-id*",
                                                 "incoming",       "set-aside",
                                                 "ballast*",       "kept-settings.toml*",
                                                 "step-cost-ns*",  "tls",
                                                 "run.log*",       "report.txt*",
                                                 ".address.new.*", ".report.txt.new.*"};
/// Those of kOurs that root itself made there in earlier versions.
constexpr std::array<std::string_view, 3> kMadeByRoot{"lock", "run.lock", "address"};
constexpr int kDepthMax = 4;

bool is_ours(std::string_view name) {
    return std::ranges::any_of(kOurs, [name](std::string_view ours) {
        return ours.ends_with('*') ? name.starts_with(ours.substr(0, ours.size() - 1)) : name == ours;
    });
}

Error refused(const std::filesystem::path& what, std::string_view why) {
    return make_error(ErrorCode::not_permitted, "the state folder is not used: ", what.native(), ' ', why,
                      ". Give a folder of its own with --state, or remove that");
}

/// The names in an open folder.
std::vector<std::string> names_in(int folder) {
    std::vector<std::string> names;
    const int own = ::openat(folder, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR* const entries = own >= 0 ? ::fdopendir(own) : nullptr;
    if (entries == nullptr) return names;
    while (const dirent* entry = ::readdir(entries)) {
        const std::string_view name{entry->d_name};
        if (name != "." && name != "..") names.emplace_back(name);
    }
    ::closedir(entries);
    return names;
}

/// The folder tree, closed and looked at. Undoes the closing unless it was given away.
class ClosedFolder {
  public:
    /// `folder` is open at `path`, and `found` is what it is.
    ClosedFolder(UniqueFd folder, std::filesystem::path path, const struct stat& found)
        : folder_(std::move(folder)), path_(std::move(path)), was_(found) {}
    ClosedFolder(ClosedFolder&&) = default;
    ClosedFolder(const ClosedFolder&) = delete;
    ClosedFolder& operator=(const ClosedFolder&) = delete;
    ~ClosedFolder() {
        if (!folder_.valid()) return;
        static_cast<void>(::fchown(folder_.get(), was_.st_uid, was_.st_gid) == 0 &&
                          ::fchmod(folder_.get(), was_.st_mode & 0777) == 0);
    }

    /// `owners`: whose entries are believed; the second is the folder's, before.
    Result<void> close(const std::array<uid_t, 3>& owners, int depth = 0) {
        if (::fchown(folder_.get(), 0, 0) != 0 || ::fchmod(folder_.get(), 0700) != 0)
            return system_error("close", path_.native());
        for (const std::string& name : names_in(folder_.get())) {
            const std::filesystem::path path = path_ / name;
            if (depth == 0 && !is_ours(name)) return refused(path, "is not the printer's");
            UniqueFd entry{::openat(folder_.get(), name.c_str(), O_PATH | O_NOFOLLOW | O_CLOEXEC)};
            struct stat found {};
            if (!entry.valid() || ::fstat(entry.get(), &found) != 0)
                return system_error("look at", path.native());
            if (std::ranges::find(owners, found.st_uid) == owners.end())
                return refused(path, "belongs to another user");
            // Root's in a folder that was another user's: he may have moved it here. Ours hold
            // nothing and are made anew.
            if (found.st_uid == 0 && owners[1] != 0) {
                if (depth > 0 || std::ranges::find(kMadeByRoot, name) == kMadeByRoot.end())
                    return refused(path, "belongs to root");
                ::unlinkat(folder_.get(), name.c_str(), 0);
                continue;
            }
            QDUINO_TRY(take(std::move(entry), found, name, owners, depth));
        }
        return {};
    }

    Result<void> give_to(uid_t user, gid_t group) {
        for (ClosedFolder& inner : folders_) QDUINO_TRY(inner.give_to(user, group));
        // By name: since the folder is closed, each is still what was looked at.
        for (const std::string& name : files_) {
            if (::fchownat(folder_.get(), name.c_str(), user, group, AT_SYMLINK_NOFOLLOW) != 0)
                return system_error("give away", (path_ / name).native());
        }
        if (::fchown(folder_.get(), user, group) != 0) return system_error("give away", path_.native());
        folder_.reset();
        return {};
    }

  private:
    Result<void> take(UniqueFd entry, const struct stat& found, const std::string& name,
                      const std::array<uid_t, 3>& owners, int depth) {
        const std::filesystem::path path = path_ / name;
        if (S_ISDIR(found.st_mode)) {
            if (depth >= kDepthMax) return refused(path, "lies too deep");
            UniqueFd inner{::openat(entry.get(), ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
            if (!inner.valid()) return system_error("open", path.native());
            folders_.emplace_back(std::move(inner), path, found);
            return folders_.back().close(owners, depth + 1);
        }
        const bool link = S_ISLNK(found.st_mode) && depth == 0 && name == "serial";
        if (!S_ISREG(found.st_mode) && !link) return refused(path, "is neither a plain file nor a folder");
        if (found.st_nlink > 1) return refused(path, "has a second name elsewhere (a hard link)");
        files_.push_back(name);
        return {};
    }

    UniqueFd folder_;
    std::filesystem::path path_;
    struct stat was_;
    std::vector<ClosedFolder> folders_;
    std::vector<std::string> files_;
};

}  // namespace

Result<void> hand_over_state(const std::filesystem::path& path, uid_t user, gid_t group) {
    if (::mkdir(path.c_str(), 0700) != 0 && errno != EEXIST)
        return system_error("make the state folder", path.native());
    QDUINO_TRY_ASSIGN(UniqueFd folder, posix::open_folder_guarded(path));
    struct stat found {};
    if (::fstat(folder.get(), &found) != 0) return system_error("look at", path.native());
    if (found.st_uid == user) return {};
    const passwd* const nobody = ::getpwnam("nobody");
    const uid_t before = nobody ? nobody->pw_uid : 0;
    if (found.st_uid != 0 && found.st_uid != before) return refused(path, "belongs to another user");
    ClosedFolder closed{std::move(folder), path, found};
    QDUINO_TRY(closed.close({0, found.st_uid, user}));
    return closed.give_to(user, group);
}

}  // namespace qduino::rights
