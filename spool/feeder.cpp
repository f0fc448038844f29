#include "spool/feeder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

namespace qduino::spool {

Result<Feeder> Feeder::open(const std::filesystem::path& path, std::uint64_t run_id, std::uint64_t length,
                            double estimated_s) {
    posix::UniqueFd file{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
    if (!file.valid()) return make_error(ErrorCode::not_found, "the job's file cannot be opened");
    struct stat found {};
    if (::fstat(file.get(), &found) != 0 || static_cast<std::uint64_t>(found.st_size) != length) {
        return make_error(ErrorCode::corrupt, "the job's file has not the length that was uploaded");
    }
    return Feeder{std::move(file), run_id, length, estimated_s};
}

Result<std::size_t> Feeder::read_at(std::uint64_t offset, std::span<std::uint8_t> bytes) {
    ssize_t read = 0;
    do {
        read = ::pread(file_.get(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
    } while (read < 0 && errno == EINTR);
    if (read <= 0) return make_error(ErrorCode::corrupt, "the job's file cannot be read to its end");
    return static_cast<std::size_t>(read);
}

}  // namespace qduino::spool
