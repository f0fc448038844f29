#include "qduino/build/prepared_headers.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <system_error>

#include "posix/small_file.h"
#include "qduino/common/build_step.h"
#include "qduino/common/words.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// A header of that name has to be there as well: where the file cannot be taken, and where the
/// name comes a second time, the compiler opens it.
constexpr const char* kThrough = "#include_next <Arduino.h>\n";

fs::path arduino_header(const Sdk& sdk) {
    std::error_code ignored;
    for (const std::string& folder : sdk.include) {
        const fs::path header = fs::path(folder) / "Arduino.h";
        if (fs::exists(header, ignored)) return header;
    }
    return {};
}

}  // namespace

PreparedHeaders::PreparedHeaders(const Sdk& sdk, Words compiler, const fs::path& cache)
    : header_(arduino_header(sdk)), compiler_(std::move(compiler)) {
    const fs::path home = sdk.file.parent_path();
    Words key = compiler_;
    key.push_back(header_.string());
    folder_ = (::access(home.c_str(), W_OK) == 0 ? home : cache) / "headers" / hash_of(key);
}

posix::UniqueFd PreparedHeaders::make(bool verbose) const {
    std::error_code failed;
    fs::create_directories(folder_, failed);
    posix::UniqueFd lock{::open((folder_ / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)};
    if (header_.empty() || !lock.valid() || ::flock(lock.get(), LOCK_EX) != 0) return {};
    const fs::path through = folder_ / "Arduino.h";
    BuildStep step{.title = "Reading Arduino.h, once for all sketches",
                   .command = compiler_,
                   .inputs = {header_},
                   .output = folder_ / "Arduino.h.gch",
                   .depfile = folder_ / "Arduino.h.d"};
    append(step.command, {"-w", "-MD", "-MF", step.depfile.string(), "-x", "c++-header", "-c",
                          through.string(), "-o", step.output.string()});
    if (!is_up_to_date(step)) {
        if (!posix::write_file(through, kThrough)) return {};
        const Result<StepsDone> made = run_steps({step}, verbose);
        if (!made || made->failed) fs::remove(step.output, failed);
    }
    // Shared: many compile with it at a time, and a change waits for them.
    ::flock(lock.get(), LOCK_SH);
    return lock;
}

}  // namespace qduino::apps
