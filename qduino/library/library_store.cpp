#include "qduino/library/library_store.h"

#include <stdlib.h>

#include <algorithm>
#include <system_error>

#include "posix/small_file.h"
#include "qduino/common/build_step.h"
#include "qduino/common/tool_run.h"
#include "qduino/common/words.h"
#include "spool/disk/sha256.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kArchiveMax = 256u << 20;

/// The first thing in `folder` that is neither a file nor a folder: a link could lead anywhere.
std::string first_oddity(const fs::path& folder) {
    std::error_code failed;
    for (fs::recursive_directory_iterator entry(folder, failed);
         !failed && entry != fs::recursive_directory_iterator{}; entry.increment(failed)) {
        const fs::file_type type = entry->symlink_status(failed).type();
        const std::string name = entry->path().filename();
        // A compiler shows the name on a terminal, which obeys it.
        if (without_controls(name) != name) return without_controls(name);
        if (type != fs::file_type::regular && type != fs::file_type::directory) return name;
    }
    return {};
}

/// The folder of the library in what was unpacked: a zip of a repository has one folder around it.
fs::path library_within(const fs::path& unpacked) {
    std::error_code failed;
    fs::directory_iterator entries(unpacked, failed);
    if (failed || entries == fs::directory_iterator{}) return unpacked;
    const fs::path only = entries->path();
    const bool alone = ++entries == fs::directory_iterator{};
    return alone && fs::is_directory(only, failed) ? only : unpacked;
}

std::string without_suffix(std::string name, std::string_view suffix) {
    if (name.size() > suffix.size() && name.ends_with(suffix)) name.resize(name.size() - suffix.size());
    return name;
}

/// "Foo" of "https://host/people/Foo.git", "Foo-master.zip", "/home/me/Foo".
std::string name_in(const std::string& path) {
    std::string name = fs::path(path).lexically_normal().filename().string();
    if (name.empty()) name = fs::path(path).lexically_normal().parent_path().filename().string();
    for (const char* suffix : {".git", ".zip", "-master", "-main"}) name = without_suffix(name, suffix);
    return name;
}

}  // namespace

/// A hidden folder beside the libraries, gone when it is left.
class LibraryStore::Staging {
  public:
    explicit Staging(const fs::path& libraries) {
        std::error_code failed;
        fs::create_directories(libraries, failed);
        std::string pattern = (libraries / ".qduino-XXXXXX").string();
        if (::mkdtemp(pattern.data())) folder_ = pattern;
    }
    ~Staging() {
        std::error_code failed;
        if (valid()) fs::remove_all(folder_, failed);
    }
    Staging(const Staging&) = delete;
    Staging& operator=(const Staging&) = delete;

    [[nodiscard]] bool valid() const { return !folder_.empty(); }
    [[nodiscard]] Result<void> check(const fs::path& libraries) const {
        if (valid()) return {};
        return make_error(
            ErrorCode::not_permitted,
            "cannot write here; name another folder with QDUINO_LIBRARIES: ", libraries.native());
    }
    /// Where the library is to be made.
    [[nodiscard]] fs::path fresh() const { return folder_ / "new"; }
    [[nodiscard]] fs::path file(const char* name) const { return folder_ / name; }

  private:
    fs::path folder_;
};

std::string library_folder_name(const std::string& name) {
    std::string folder;
    for (const char c : name.substr(0, 63)) {
        const bool kept = std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '.';
        folder += kept ? c : '_';
    }
    if (folder.empty() || folder.front() == '.' || folder.front() == '-') folder.insert(0, "_");
    return folder;
}

Result<Library> LibraryStore::accept(const Staging& staging, const std::string& fallback_name) const {
    const fs::path made = library_within(staging.fresh());
    const std::string odd = first_oddity(made);
    if (!odd.empty())
        return make_error(
            ErrorCode::invalid_argument,
            "a library may hold files and folders alone, with names that can be printed, and no "
            "links: ",
            odd);
    std::optional<Library> library = read_library(made);
    if (!library) {
        return make_error(ErrorCode::invalid_argument,
                          "that is no library: it has neither a library.properties nor a header at its top");
    }
    const std::string folder_name = made == staging.fresh() ? fallback_name : name_in(made.string());
    const bool says_its_name = library->name != made.filename();
    const fs::path target = folder_ / library_folder_name(says_its_name ? library->name : folder_name);
    std::error_code failed;
    if (fs::exists(fs::symlink_status(target, failed))) {
        return make_error(ErrorCode::already_exists,
                          "is there already ('qduino lib remove' takes it away first): ", target.native());
    }
    fs::rename(made, target, failed);
    if (failed) return make_error(ErrorCode::not_permitted, "cannot be made: ", target.native());
    return *read_library(target);
}

Result<Library> LibraryStore::add_folder(const fs::path& folder) const {
    std::error_code failed;
    const fs::path from = fs::canonical(folder, failed);
    if (failed || !fs::is_directory(from))
        return make_error(ErrorCode::not_found, "no such folder: ", folder.native());
    const Staging staging(folder_);
    QDUINO_TRY(staging.check(folder_));
    if (fs::canonical(folder_, failed).string().starts_with(from.string() + '/'))
        return make_error(ErrorCode::invalid_argument, "holds the libraries themselves: ", from.native());
    fs::copy(from, staging.fresh(), fs::copy_options::recursive | fs::copy_options::copy_symlinks, failed);
    if (failed) return make_error(ErrorCode::unavailable, "cannot be copied: ", from.native());
    fs::remove_all(staging.fresh() / ".git", failed);
    return accept(staging, name_in(from.string()));
}

Result<void> LibraryStore::unpack(const fs::path& archive, const Staging& staging) const {
    return run_tool({tools_.python, tools_.unpack_zip.string(), archive.string(), staging.fresh().string()},
                    staging.file("log"));
}

Result<Library> LibraryStore::add_zip(const fs::path& archive) const {
    const Staging staging(folder_);
    QDUINO_TRY(staging.check(folder_));
    QDUINO_TRY(unpack(archive, staging));
    return accept(staging, name_in(archive.string()));
}

Result<Library> LibraryStore::add_git(const std::string& url) const {
    const std::size_t hash = std::min(url.find('#'), url.size());
    const std::string repository = url.substr(0, hash);
    const Staging staging(folder_);
    QDUINO_TRY(staging.check(folder_));
    // No transport that runs a command (ext::) or takes what is open here (fd::).
    Words command{"env",
                  "GIT_TERMINAL_PROMPT=0",
                  "GIT_ALLOW_PROTOCOL=file:git:https:ssh",
                  "git",
                  "clone",
                  "--quiet",
                  "--depth",
                  "1"};
    if (hash + 1 < url.size()) append(command, {"--branch=" + url.substr(hash + 1)});
    append(command, {"--", repository, staging.fresh().string()});
    QDUINO_TRY(run_tool(command, staging.file("log")));
    std::error_code failed;
    fs::remove_all(staging.fresh() / ".git", failed);
    return accept(staging, name_in(repository));
}

Result<Library> LibraryStore::add_download(const std::string& url, const ArchiveFacts& facts) const {
    const Staging staging(folder_);
    QDUINO_TRY(staging.check(folder_));
    const fs::path archive = staging.file("archive.zip");
    QDUINO_TRY(download(url, archive, facts.size > 0 ? facts.size : kArchiveMax));
    QDUINO_TRY_ASSIGN(const std::string bytes, posix::read_small_file(archive));
    const bool size_is_right = facts.size == 0 || bytes.size() == facts.size;
    if (!size_is_right || (!facts.sha256.empty() && spool::sha256_of(bytes) != facts.sha256)) {
        return make_error(
            ErrorCode::corrupt,
            "what was downloaded is not what the index promises (its size or SHA-256 differs): ", url);
    }
    QDUINO_TRY(unpack(archive, staging));
    return accept(staging, name_in(url));
}

std::optional<Library> LibraryStore::find(const std::string& name) const {
    for (Library& library : libraries_in(folder_)) {
        if (library.name == name || library.folder.filename() == name) return std::move(library);
    }
    return std::nullopt;
}

Result<Library> LibraryStore::remove(const std::string& name) const {
    const std::optional<Library> library = find(name);
    if (!library) return make_error(ErrorCode::not_found, "no library '", name, "' in ", folder_.native());
    // Out of sight first: a removal that is broken off leaves no half of a library.
    const Staging staging(folder_);
    QDUINO_TRY(staging.check(folder_));
    std::error_code failed;
    fs::rename(library->folder, staging.fresh(), failed);
    if (failed) return make_error(ErrorCode::not_permitted, "cannot be removed: ", library->folder.native());
    return *library;
}

Result<void> download(const std::string& url, const fs::path& file, std::uint64_t bytes_max) {
    fs::path log = file;
    log += ".log";
    const Words command{"curl",
                        "--fail",
                        "--silent",
                        "--show-error",
                        "--location",
                        "--compressed",
                        "--proto",
                        "=https,http,file",
                        "--proto-redir",
                        "=https,http",
                        "--connect-timeout",
                        "20",
                        "--max-filesize",
                        std::to_string(bytes_max),
                        "--output",
                        file.string(),
                        "--",
                        url};
    const Result<void> done = run_tool(command, log);
    std::error_code failed;
    fs::remove(log, failed);
    return done;
}

}  // namespace qduino::apps
