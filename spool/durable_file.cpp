#include "spool/durable_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace qduino::spool {

Error file_error(std::string_view what, int number) {
    if (number == ENOSPC || number == EDQUOT) {
        return make_error(ErrorCode::unavailable,
                          "the disk is full; delete finished jobs or free some space");
    }
    const ErrorCode code =
        number == EACCES || number == EPERM ? ErrorCode::not_permitted : ErrorCode::internal;
    Error error{code, {}};
    error.message.append("job files: cannot ").append(what).append(": ").append(std::strerror(number));
    return error;
}

Result<void> write_all(int descriptor, std::span<const char> bytes) {
    while (!bytes.empty()) {
        const ssize_t count = ::write(descriptor, bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) return file_error("write", errno);
        bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
    return {};
}

Result<void> sync_to_disk(const std::filesystem::path& path) {
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) return file_error("open what is to be synced", errno);
    const int failed = ::fsync(descriptor) != 0 ? errno : 0;
    ::close(descriptor);
    return failed ? Result<void>{file_error("sync", failed)} : Result<void>{};
}

Result<void> rename_and_sync(const std::filesystem::path& from, const std::filesystem::path& to) {
    if (::rename(from.c_str(), to.c_str()) != 0) return file_error("rename", errno);
    return sync_to_disk(to.parent_path());
}

Result<void> write_file(const std::filesystem::path& path, std::string_view bytes) {
    const std::filesystem::path part = path.string() + ".part";
    const int descriptor = ::open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (descriptor < 0) return file_error("create", errno);
    Result<void> written = write_all(descriptor, {bytes.data(), bytes.size()});
    if (written.ok() && ::fdatasync(descriptor) != 0) written = file_error("sync", errno);
    ::close(descriptor);
    if (written.ok() && ::rename(part.c_str(), path.c_str()) != 0) written = file_error("rename", errno);
    if (!written.ok()) ::unlink(part.c_str());
    return written;
}

}  // namespace qduino::spool
