#include "apps/link/link_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <new>
#include <string>
#include <utility>

namespace qduino::apps {

using printer::link::LinkLayout;

namespace {

Error system_error(std::string_view what, const std::filesystem::path& path, int number) {
    ErrorCode code = ErrorCode::internal;
    if (number == ENOENT) code = ErrorCode::not_found;
    if (number == EACCES || number == EPERM) code = ErrorCode::not_permitted;
    if (number == ENOSPC || number == EDQUOT) code = ErrorCode::unavailable;
    Error error{code, {}};
    error.message.append("link: ").append(what).append(" ").append(path.native());
    error.message.append(": ").append(std::strerror(number));
    return error;
}

LinkLayout* map(int descriptor) {
    void* at = ::mmap(nullptr, sizeof(LinkLayout), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
    return at == MAP_FAILED ? nullptr : static_cast<LinkLayout*>(at);
}

std::uint64_t random_session() {
    std::uint64_t session = 0;
    while (session == 0) {
        if (::getrandom(&session, sizeof session, 0) != static_cast<ssize_t>(sizeof session)) session = 0;
    }
    return session;
}

/// A sketch that runs as root gives the object to the folder's owner: the service is not root.
void give_to_owner_of_folder(int descriptor, const std::filesystem::path& path) {
    struct stat folder {};
    const std::filesystem::path parent = path.has_parent_path() ? path.parent_path() : ".";
    if (::geteuid() != 0 || ::stat(parent.c_str(), &folder) != 0) return;
    // Failing leaves the object to root alone, which the service reports as not permitted.
    static_cast<void>(::fchown(descriptor, folder.st_uid, folder.st_gid) == 0);
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
        return Error{ErrorCode::corrupt, FixedString<236>{"link: not a link: "}.append(path.native())};
    }
    if (layout.version != printer::link::kVersion || layout.size != sizeof(LinkLayout)) {
        return Error{
            ErrorCode::unsupported,
            FixedString<236>{"link: made by another version, build both sides anew: "}.append(path.native())};
    }
    if (layout.session == 0) {
        return Error{ErrorCode::corrupt, FixedString<236>{"link: no session: "}.append(path.native())};
    }
    return {};
}

}  // namespace

LinkFile::LinkFile(LinkFile&& other) noexcept { *this = std::move(other); }

LinkFile& LinkFile::operator=(LinkFile&& other) noexcept {
    if (this == &other) return *this;
    close();
    layout_ = std::exchange(other.layout_, nullptr);
    descriptor_ = std::exchange(other.descriptor_, -1);
    device_ = other.device_;
    inode_ = other.inode_;
    return *this;
}

LinkFile::~LinkFile() { close(); }

void LinkFile::close() {
    if (layout_) ::munmap(static_cast<void*>(layout_), sizeof(LinkLayout));
    if (descriptor_ >= 0) ::close(descriptor_);
    layout_ = nullptr;
    descriptor_ = -1;
}

bool LinkFile::is_current(const std::filesystem::path& path) const {
    struct stat now {};
    return layout_ && ::stat(path.c_str(), &now) == 0 && now.st_ino == inode_ && now.st_dev == device_;
}

Result<LinkFile> create_link(const std::filesystem::path& path, std::uint64_t started_unix_s) {
    const std::filesystem::path temporary =
        path.parent_path() / ("." + path.filename().string() + ".tmp." + std::to_string(::getpid()));
    ::unlink(temporary.c_str());
    LinkFile file;
    file.descriptor_ = ::open(temporary.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0660);
    if (file.descriptor_ < 0) return system_error("cannot create", temporary, errno);
    const auto fail = [&](std::string_view what, int number) {
        ::unlink(temporary.c_str());
        return system_error(what, temporary, number);
    };
    // Reserved, not sparse: a full file system is found here and not by a SIGBUS in a real-time loop.
    if (const int number = ::posix_fallocate(file.descriptor_, 0, sizeof(LinkLayout)); number != 0) {
        return fail("no space for", number);
    }
    static_cast<void>(::fchmod(file.descriptor_, 0660) == 0);
    give_to_owner_of_folder(file.descriptor_, path);
    file.layout_ = map(file.descriptor_);
    if (!file.layout_) return fail("cannot map", errno);
    write_header(*new (file.layout_) LinkLayout, started_unix_s);
    struct stat made {};
    if (::fstat(file.descriptor_, &made) != 0) return fail("cannot stat", errno);
    file.device_ = made.st_dev;
    file.inode_ = made.st_ino;
    if (::rename(temporary.c_str(), path.c_str()) != 0) return fail("cannot rename", errno);
    return file;
}

Result<LinkFile> open_link(const std::filesystem::path& path) {
    LinkFile file;
    file.descriptor_ = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
    if (file.descriptor_ < 0) return system_error("cannot open", path, errno);
    struct stat found {};
    if (::fstat(file.descriptor_, &found) != 0) return system_error("cannot stat", path, errno);
    if (!S_ISREG(found.st_mode) || static_cast<std::uint64_t>(found.st_size) != sizeof(LinkLayout)) {
        return Error{ErrorCode::unsupported,
                     FixedString<236>{"link: not a link of this version: "}.append(path.native())};
    }
    if (::flock(file.descriptor_, LOCK_EX | LOCK_NB) != 0) {
        return Error{ErrorCode::already_exists,
                     FixedString<236>{"link: another print service holds "}.append(path.native())};
    }
    file.layout_ = map(file.descriptor_);
    if (!file.layout_) return system_error("cannot map", path, errno);
    const Result<void> header = check_header(*file.layout_, path);
    if (!header.ok()) return header.error();
    file.device_ = found.st_dev;
    file.inode_ = found.st_ino;
    return file;
}

}  // namespace qduino::apps
