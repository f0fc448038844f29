#include "spool/analyzer.h"

#include <fcntl.h>

#include <array>

#include "posix/small_file.h"
#include "posix/unique_fd.h"

namespace qduino::spool {

Result<Analysis> Analyzer::analyze(const std::filesystem::path& gcode, const std::filesystem::path& layers) {
    const posix::UniqueFd file{::open(gcode.c_str(), O_RDONLY | O_CLOEXEC)};
    const std::unique_ptr<FileReading> reading = begin(layers);
    std::array<char, 16 * 1024> bytes;
    for (;;) {
        const Result<std::size_t> count = posix::read_some(file.get(), bytes, "the uploaded file");
        if (!count.ok()) return make_error(ErrorCode::internal, "the uploaded file cannot be read back");
        if (*count == 0) return reading->finish();
        if (std::optional<Analysis> refusal = reading->feed({bytes.data(), *count})) return *refusal;
    }
}

}  // namespace qduino::spool
