#include "posix/file_bytes.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "posix/small_file.h"
#include "posix/system_error.h"

namespace qduino::posix {

FileBytes::FileBytes(UniqueFd file) : file_(std::move(file)) {
    struct stat found {};
    if (file_.valid() && ::fstat(file_.get(), &found) == 0) size_ = static_cast<std::uint64_t>(found.st_size);
}

std::shared_ptr<const FileBytes> FileBytes::open(const std::filesystem::path& path) {
    UniqueFd file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW)};
    return file.valid() ? std::make_shared<const FileBytes>(std::move(file)) : nullptr;
}

Result<std::size_t> FileBytes::read_at(std::uint64_t offset, std::span<char> bytes) const {
    ssize_t read = 0;
    do {
        read = ::pread(file_.get(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
    } while (read < 0 && errno == EINTR);
    if (read < 0) return make_error(ErrorCode::corrupt, "the file cannot be read to its end");
    return static_cast<std::size_t>(read);
}

Result<void> FileSink::write(std::span<const char> bytes) {
    if (!file_.valid())
        file_ = UniqueFd{::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600)};
    if (!file_.valid()) return system_error("create", path_.native());
    return write_all(file_.get(), bytes, path_.native());
}

}  // namespace qduino::posix
