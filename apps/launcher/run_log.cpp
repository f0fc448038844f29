#include "apps/launcher/run_log.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <ctime>

#include "posix/small_file.h"
#include "posix/system_error.h"
#include "terminal/message.h"

namespace qduino::launcher {
namespace {

std::string now_in_words() {
    const std::time_t now = std::time(nullptr);
    std::tm local{};
    ::localtime_r(&now, &local);
    std::array<char, 32> words{};
    std::strftime(words.data(), words.size(), "%Y-%m-%d %H:%M:%S ", &local);
    return words.data();
}

/// The last `most` bytes of a file from `begin` on.
std::string end_of(int file, off_t begin, off_t size, std::size_t most) {
    begin = std::max(begin, size - static_cast<off_t>(most));
    std::string text(static_cast<std::size_t>(std::max<off_t>(size - begin, 0)), '\0');
    const ssize_t got = ::pread(file, text.data(), text.size(), begin);
    text.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    return text;
}

}  // namespace

Result<RunLog> RunLog::make(const std::filesystem::path& folder) {
    RunLog log;
    log.path_ = folder / "run.log";
    // A link is renamed itself. There may be none, or a folder that stays: open(2) says so then.
    std::error_code ignored;
    std::filesystem::rename(log.path_, folder / "run.log.1", ignored);
    constexpr int kFlags = O_RDWR | O_APPEND | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC;
    log.file_.reset(::open(log.path_.c_str(), kFlags, 0600));
    if (!log.file_.valid()) return posix::system_error("make", log.path_.native());
    return log;
}

void RunLog::say(std::string_view words) const {
    constexpr std::string_view kSpeaker = "run: ";
    apps::say(words, kSpeaker);
    if (!file_.valid()) return;
    std::string line = now_in_words();
    line.append(kSpeaker).append(words).append("\n");
    // A failure, of a full disk for one: the terminal has it.
    static_cast<void>(posix::write_all(file_.get(), line, "the log"));
}

off_t RunLog::size() const {
    struct stat found {};
    return file_.valid() && ::fstat(file_.get(), &found) == 0 ? found.st_size : 0;
}

std::string RunLog::since(off_t begin) const {
    return file_.valid() ? plain_lines(end_of(file_.get(), begin, size(), kTail)) : std::string{};
}

// A line that comes between the two calls is lost: this is once in megabytes.
void RunLog::keep_small(off_t limit) const {
    if (size() <= limit) return;
    std::string kept = end_of(file_.get(), 0, size(), static_cast<std::size_t>(std::min(kKept, limit / 2)));
    kept.erase(0, kept.find('\n') + 1);
    if (::ftruncate(file_.get(), 0) == 0) static_cast<void>(posix::write_all(file_.get(), kept, "the log"));
}

std::string plain_lines(std::string_view text) {
    std::string plain;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto byte = static_cast<unsigned char>(text[i]);
        const auto next = i + 1 < text.size() ? static_cast<unsigned char>(text[i + 1]) : 0U;
        // U+0080 to U+009F are control characters, too; one of them begins a terminal's commands.
        if (byte == 0xc2 && next >= 0x80 && next < 0xa0) {
            ++i;
        } else if (byte == '\n' || (byte >= ' ' && byte != 0x7f)) {
            plain += text[i];
        }
    }
    return plain;
}

}  // namespace qduino::launcher
