#include "posix/durable_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>

#include "posix/small_file.h"
#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::posix {

Result<void> sync_to_disk(const std::filesystem::path& path) {
    const UniqueFd file{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
    if (!file.valid()) return system_error("open", path.native());
    if (::fsync(file.get()) != 0) return system_error("sync", path.native());
    return {};
}

Result<void> rename_and_sync(const std::filesystem::path& from, const std::filesystem::path& to) {
    if (::rename(from.c_str(), to.c_str()) != 0) return system_error("rename", from.native());
    return sync_to_disk(to.parent_path());
}

Result<void> write_durably(const std::filesystem::path& path, std::string_view bytes, unsigned mode) {
    const std::filesystem::path part = path.string() + ".part";
    // Never what has that name already: it may be another name (a hard link) of a foreign file.
    ::unlink(part.c_str());
    const UniqueFd file{
        ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, mode)};
    if (!file.valid()) return system_error("create", part.native());
    Result<void> written = write_all(file.get(), bytes, part.native());
    if (written.ok() && ::fdatasync(file.get()) != 0) written = system_error("sync", part.native());
    if (written.ok() && ::rename(part.c_str(), path.c_str()) != 0)
        written = system_error("rename", part.native());
    if (!written.ok()) ::unlink(part.c_str());
    return written;
}

}  // namespace qduino::posix
