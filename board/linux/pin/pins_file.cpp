#include "board/linux/pin/pins_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <new>

#include "base/contract.h"
#include "base/words.h"
#include "board/linux/kernel/clock.h"
#include "posix/system_error.h"

namespace qduino::board::linux {

using posix::map_shared;
using posix::Mapping;
using posix::system_error;
using posix::UniqueFd;

namespace {

constexpr Words<PinsRole::machine, PinsRole::supervisor> kRoles{"machine", "sketch", "supervisor"};

/// Takes the role's byte of the file. The lock belongs to the open file description: it ends with
/// the process.
Result<void> take_role(int fd, PinsRole role, const std::string& path, std::size_t offset = 0) {
    struct flock lock {};
    lock.l_type = F_WRLCK;
    lock.l_whence = SEEK_SET;
    lock.l_start = static_cast<off_t>(offset + static_cast<std::size_t>(role));
    lock.l_len = 1;
    if (::fcntl(fd, F_OFD_SETLK, &lock) == 0) return {};
    if (errno != EAGAIN && errno != EACCES) return system_error("lock", path);
    return make_error(ErrorCode::unavailable, "another ", kRoles(role), " is alive on the pins ", path,
                      ": stop it first, or use another file");
}

Error not_a_pins_file(const std::string& path, std::string_view why) {
    return make_error(ErrorCode::corrupt, path, " is not a file of virtual pins: ", why);
}

Result<void> check_head(const PinsLayout& layout, std::size_t file_bytes, const std::string& path) {
    if (layout.magic.load(std::memory_order_acquire) != kPinsMagic)
        return not_a_pins_file(path, "wrong magic");
    if (layout.version != kPinsVersion) {
        return make_error(ErrorCode::unsupported, path,
                          " has another version of the pins layout: rebuild, and restart the machine");
    }
    if (layout.size != kPinsFileSize || file_bytes != kPinsFileSize)
        return not_a_pins_file(path, "wrong size");
    return {};
}

}  // namespace

Result<PinsFile> PinsFile::create(const std::string& path) {
    {  // A living machine on this path keeps it.
        const UniqueFd old{::open(path.c_str(), O_RDWR | O_CLOEXEC)};
        if (old.valid()) QDUINO_TRY(take_role(old.get(), PinsRole::machine, path));
    }
    const std::string fresh = path + "." + std::to_string(::getpid());
    PinsFile file;
    file.fd_ = UniqueFd{::open(fresh.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600)};
    if (!file.fd_.valid()) return system_error("create", fresh);
    if (::ftruncate(file.fd_.get(), static_cast<off_t>(kPinsFileSize)) != 0)
        return system_error("size", fresh);
    QDUINO_TRY(take_role(file.fd_.get(), PinsRole::machine, path));
    QDUINO_TRY_ASSIGN(file.head_, map_shared(file.fd_.get(), 0, round_to_page(sizeof(PinsLayout)), true));

    file.begin();
    if (::rename(fresh.c_str(), path.c_str()) != 0) {
        const Error error = system_error("rename", fresh);
        ::unlink(fresh.c_str());
        return error;
    }
    return file;
}

void PinsFile::begin() {
    auto* const layout = new (head_.as<void>()) PinsLayout;
    layout->version = kPinsVersion;
    layout->size = kPinsFileSize;
    layout->machine_session = static_cast<std::uint64_t>(to_ns(monotonic_now()));
    layout->machine_pid = static_cast<std::uint32_t>(::getpid());
    layout->magic.store(kPinsMagic, std::memory_order_release);
}

Result<PinsFile> PinsFile::create_in(const std::string& path, std::size_t offset) {
    PinsFile file;
    file.offset_ = offset;
    file.fd_ = UniqueFd{::open(path.c_str(), O_RDWR | O_CLOEXEC)};
    if (!file.fd_.valid()) return system_error("open the virtual pins", path);
    QDUINO_TRY(take_role(file.fd_.get(), PinsRole::machine, path, offset));
    QDUINO_TRY_ASSIGN(file.head_,
                      map_shared(file.fd_.get(), offset, round_to_page(sizeof(PinsLayout)), false));
    for (int writer = 0; writer < kVcpuLimit; ++writer) {
        QDUINO_TRY_ASSIGN(const Mapping ring, file.map_ring(writer, false));
        ring.as<NarrowRing>()->discard_all();
        ring.as<NarrowRing>()->adopt_writer();
    }
    file.begin();
    return file;
}

Result<PinsFile> PinsFile::open(const std::string& path, PinsRole role) {
    PinsFile file;
    file.fd_ = UniqueFd{::open(path.c_str(), O_RDWR | O_CLOEXEC)};
    if (!file.fd_.valid()) return system_error("open the virtual pins", path);
    struct stat status {};
    if (::fstat(file.fd_.get(), &status) != 0) return system_error("look at", path);
    const auto bytes = static_cast<std::size_t>(status.st_size);
    if (bytes < sizeof(PinsLayout)) return not_a_pins_file(path, "too short");
    QDUINO_TRY_ASSIGN(file.head_, map_shared(file.fd_.get(), 0, round_to_page(sizeof(PinsLayout)), true));
    QDUINO_TRY(check_head(file.layout(), bytes, path));
    QDUINO_TRY(take_role(file.fd_.get(), role, path));
    return file;
}

Result<Mapping> PinsFile::map_ring(int writer, bool populate) const {
    QDUINO_EXPECT(writer >= 0 && writer < kWriterCount);
    return map_shared(fd_.get(), offset_ + ring_offset(writer), ring_bytes(writer), populate);
}

}  // namespace qduino::board::linux
