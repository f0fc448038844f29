#include "link/link_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <new>
#include <string>

#include "base/whole_number.h"
#include "posix/local_socket.h"
#include "posix/small_file.h"
#include "posix/system_error.h"

namespace qduino::apps {

using printer::link::LinkLayout;

namespace {

std::uint64_t random_session() {
    std::uint64_t session = 0;
    while (session == 0) {
        if (::getrandom(&session, sizeof session, 0) != static_cast<ssize_t>(sizeof session)) session = 0;
    }
    return session;
}

void write_header(LinkLayout& layout, std::uint64_t started_unix_s) {
    layout.version = printer::link::kVersion;
    layout.size = sizeof(LinkLayout);
    layout.session = random_session();
    layout.started_unix_s = started_unix_s;
    layout.sketch_pid = static_cast<std::uint32_t>(::getpid());
    layout.magic.store(printer::link::kMagic, std::memory_order_release);
}

Result<void> check_header(const LinkLayout& layout, const std::filesystem::path& path) {
    if (layout.magic.load(std::memory_order_acquire) != printer::link::kMagic) {
        return make_error(ErrorCode::corrupt, "link: not a link: ", path.native());
    }
    if (layout.version != printer::link::kVersion || layout.size != sizeof(LinkLayout)) {
        return make_error(ErrorCode::unsupported,
                          "link: made by another version, build both sides anew: ", path.native());
    }
    if (layout.session == 0) return make_error(ErrorCode::corrupt, "link: no session: ", path.native());
    return {};
}

constexpr std::string_view kInherited = "/proc/self/fd/";
/// The launcher looks every 20 ms who asks.
constexpr int kPatienceMs = 200;

/// The inherited descriptor that `path` names.
std::optional<int> inherited(const std::filesystem::path& path) {
    std::string_view name{path.native()};
    if (!name.starts_with(kInherited)) return std::nullopt;
    return whole_number<int>(name.substr(kInherited.size()));
}

/// What the launcher hands out at its socket.
Result<posix::UniqueFd> ask_for_link(const std::filesystem::path& path) {
    QDUINO_TRY_ASSIGN(const posix::UniqueFd asked, posix::connect_local(path));
    QDUINO_TRY_ASSIGN(posix::UniqueFd given, posix::receive_descriptor(asked.get(), kPatienceMs));
    const int seals = ::fcntl(given.get(), F_GET_SEALS);
    if (seals >= 0 && (seals & F_SEAL_SHRINK) != 0) return given;
    return make_error(ErrorCode::corrupt, "link: what was given at ", path.native(), " could be cut off");
}

}  // namespace

Result<posix::UniqueFd> make_sealed_link() {
    posix::UniqueFd memory{::memfd_create("qduino-link", MFD_CLOEXEC | MFD_ALLOW_SEALING)};
    if (!memory.valid()) return posix::system_error("make", "the link's memory");
    // Reserved, as in create_link().
    if (const int number = ::posix_fallocate(memory.get(), 0, sizeof(LinkLayout)); number != 0)
        return posix::system_error("make room for", "the link", number);
    if (::fcntl(memory.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
        return posix::system_error("seal", "the link's memory");
    return memory;
}

bool is_complete_link(int descriptor) {
    const auto mapped = posix::map_shared(descriptor, 0, sizeof(LinkLayout), false);
    return mapped && check_header(*mapped->as<LinkLayout>(), {}).ok();
}

std::filesystem::path inherited_link(int descriptor) { return text<std::string>(kInherited, descriptor); }

Result<void> LinkFile::open(const std::filesystem::path& path) {
    struct stat named {};
    if (const auto number = inherited(path)) {
        descriptor_.reset(::fcntl(*number, F_DUPFD_CLOEXEC, 0));
    } else if (::lstat(path.c_str(), &named) == 0 && S_ISSOCK(named.st_mode)) {
        // Looked at before: what is put in its place meanwhile is another one.
        device_ = named.st_dev;
        inode_ = named.st_ino;
        QDUINO_TRY_ASSIGN(descriptor_, ask_for_link(path));
    } else {
        descriptor_.reset(::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    }
    return descriptor_.valid() ? Result<void>{} : posix::system_error("open", path.native());
}

Result<void> LinkFile::map() {
    struct stat found {};
    if (::fstat(descriptor_.get(), &found) != 0) return posix::system_error("look at", "the link");
    QDUINO_TRY_ASSIGN(mapping_, posix::map_shared(descriptor_.get(), 0, sizeof(LinkLayout), false));
    if (inode_ != 0) return {};
    device_ = found.st_dev;
    inode_ = found.st_ino;
    return {};
}

bool LinkFile::is_current(const std::filesystem::path& path) const {
    struct stat now {};
    return mapping_.valid() && ::stat(path.c_str(), &now) == 0 && now.st_ino == inode_ &&
           now.st_dev == device_;
}

namespace {

Result<void> check_size(int descriptor, const std::filesystem::path& path) {
    struct stat found {};
    if (::fstat(descriptor, &found) != 0) return posix::system_error("look at", path.native());
    if (S_ISREG(found.st_mode) && static_cast<std::uint64_t>(found.st_size) == sizeof(LinkLayout)) return {};
    return make_error(ErrorCode::unsupported, "link: not a link of this version: ", path.native());
}

}  // namespace

Result<LinkFile> create_link(const std::filesystem::path& path, std::uint64_t started_unix_s) {
    if (inherited(path)) {
        LinkFile given;
        QDUINO_TRY(given.open(path));
        QDUINO_TRY(check_size(given.descriptor_.get(), path));
        QDUINO_TRY(given.map());
        write_header(*new (given.get()) LinkLayout, started_unix_s);
        return given;
    }
    const std::filesystem::path temporary =
        path.parent_path() / ("." + path.filename().string() + ".tmp." + std::to_string(::getpid()));
    ::unlink(temporary.c_str());
    LinkFile file;
    file.descriptor_.reset(
        ::open(temporary.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0660));
    if (!file.descriptor_.valid()) return posix::system_error("create", temporary.native());
    const auto fail = [&](Error error) {
        ::unlink(temporary.c_str());
        return error;
    };
    // Reserved, not sparse: a full file system is found here and not by a SIGBUS in a real-time
    // loop.
    if (const int number = ::posix_fallocate(file.descriptor_.get(), 0, sizeof(LinkLayout)); number != 0) {
        return fail(posix::system_error("make room for", temporary.native(), number));
    }
    static_cast<void>(::fchmod(file.descriptor_.get(), 0660) == 0);
    posix::give_to_owner_of_folder(path, file.descriptor_.get());  // the service is not root
    if (const Result<void> mapped = file.map(); !mapped.ok()) return fail(mapped.error());
    write_header(*new (file.get()) LinkLayout, started_unix_s);
    if (::rename(temporary.c_str(), path.c_str()) != 0)
        return fail(posix::system_error("rename", temporary.native()));
    return file;
}

Result<LinkFile> map_link(const std::filesystem::path& path) {
    LinkFile file;
    QDUINO_TRY(file.open(path));
    QDUINO_TRY(check_size(file.descriptor_.get(), path));
    QDUINO_TRY(file.map());
    QDUINO_TRY(check_header(*file.get(), path));
    return file;
}

Result<LinkFile> open_link(const std::filesystem::path& path) {
    Result<LinkFile> file = map_link(path);
    if (!file.ok() || ::flock(file->descriptor_.get(), LOCK_EX | LOCK_NB) == 0) return file;
    return make_error(ErrorCode::already_exists, "link: another print service holds ", path.native());
}

}  // namespace qduino::apps
