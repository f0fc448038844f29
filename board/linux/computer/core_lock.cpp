#include "board/linux/computer/core_lock.h"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <ctime>
#include <optional>
#include <utility>

#include "base/whole_number.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/core_rivals.h"
#include "board/linux/kernel/kernel_text.h"
#include "posix/guarded_file.h"

namespace qduino::board::linux {

using posix::UniqueFd;

namespace {

constexpr Nanoseconds kLookAgain = 20ms;
constexpr std::size_t kCommandShown = 60;

/// Without the folder of its program, which is long and says little.
std::string command_of(const std::string& pid) {
    const std::string text = text_of_file("/proc/" + pid + "/cmdline");
    const std::size_t slash = text.substr(0, text.find('\0')).rfind('/');
    return printable(text.substr(slash + 1), 200);  // of all, where there is no slash
}

struct Holder {
    std::string pid, since, program, command;
};

/// The words of the holder. It may be writing them just now: then some are empty.
Holder read_holder(int file) {
    std::array<char, 512> bytes{};
    const ssize_t count = ::pread(file, bytes.data(), bytes.size(), 0);
    std::string_view lines{bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0))};
    Holder holder;
    while (!lines.empty()) {
        std::string_view value = cut(lines, '\n');
        const std::string_view key = cut(value, ' ');
        if (key == "pid" && whole_number<unsigned>(value)) holder.pid = value;
        if (key == "since") holder.since = printable(value, 24);
        if (key == "program") holder.program = printable(value, 15);
        if (key == "command") holder.command = printable(value, kCommandShown);
    }
    return holder;
}

/// Is SIGKILL among the signals of this line of /proc/PID/status, "SigPnd:\t0000000000000100"?
bool names_kill(std::string_view status, std::string_view line) {
    const std::size_t at = status.find(line);
    if (at == std::string_view::npos) return false;
    const std::string_view digits = status.substr(at + line.size(), 16);
    std::uint64_t signals = 0;
    std::from_chars(digits.data(), digits.data() + digits.size(), signals, 16);
    return (signals >> (SIGKILL - 1) & 1) != 0;
}

/// It was killed, and not all of its threads have gone.
bool is_dying(const std::string& pid, const std::string& root) {
    const std::string status = text_of_file(root + "/proc/" + pid + "/status");
    return status.find("\nState:\tZ") != std::string::npos || names_kill(status, "\nSigPnd:\t") ||
           names_kill(status, "\nShdPnd:\t");
}

/// Whose fault it is: a holder that is dying waits for whoever spins on its core.
Error taken(int core, const Holder& holder, const std::string& root) {
    const std::string spinner = who_spins_on(core, whole_number<pid_t>(holder.pid).value_or(0), root);
    if (!spinner.empty() && !holder.pid.empty() && is_dying(holder.pid, root)) {
        return make_error(ErrorCode::unavailable, "core ", core, " is taken: ", holder.program, " (pid ",
                          holder.pid, ") was killed and cannot end, because ", spinner,
                          " runs on that core without a pause: stop that task");
    }
    auto by = text<std::string>("another sketch owns it");
    if (!holder.pid.empty()) {
        by = text<std::string>(holder.program.empty() ? "a sketch" : holder.program, " (pid ", holder.pid,
                               ") owns it since ", holder.since, ", started as `", holder.command, '`');
    }
    return make_error(ErrorCode::unavailable, "core ", core, " is taken: ", by,
                      ": stop that one, or give the loop another core",
                      spinner.empty() ? "" : ". On that core runs without a pause: ", spinner);
}

Error spun_on(int core, const std::string& spinner) {
    return make_error(
        ErrorCode::unavailable, "core ", core, " is taken: ", spinner,
        " runs on it without a pause, and is no sketch: stop it, or give the loop another core");
}

std::string lock_of(const std::string& folder, int core) {
    return text<std::string>(folder, "/qduino-core", core, ".lock");
}

/// Root's sketch owns the core, whoever asks: the words in its file.
std::optional<Holder> root_has(int core, const std::string& root, const std::string& own) {
    for (const std::string& folder : believed_registers(root, own)) {
        if (folder == own) continue;
        const auto file = posix::open_guarded(lock_of(folder, core), O_RDONLY);
        if (file && is_locked(file->get())) return read_holder(file->get());
    }
    return std::nullopt;
}

/// Nobody has the core, and another user stands in the way with a lock for reading: he may have
/// that on a file of root, and must not. The file goes, and with it his lock.
void leave_reader_behind(int file, const std::string& path) {
    if (!is_locked(file) && is_still_named(file, path)) ::unlink(path.c_str());
}

}  // namespace

Result<CoreLock> CoreLock::take(int core, Nanoseconds patience, const std::string& root) {
    QDUINO_TRY_ASSIGN(const std::string folder, own_register(root));
    const std::string path = lock_of(folder, core);
    const Instant until = monotonic_now() + patience;
    for (;;) {
        QDUINO_TRY_ASSIGN(UniqueFd file, posix::open_or_make_guarded(path, 0644));
        std::optional<Holder> holder = root_has(core, root, folder);
        if (!holder && lock_whole(file.get())) {
            if (!is_still_named(file.get(), path)) continue;
            CoreLock lock;
            lock.file_ = HeldFile{std::move(file), path};
            lock.write_holder();
            const std::string spinner = who_spins_on(core, ::getpid(), root);
            if (spinner.empty()) return lock;
            if (monotonic_now() >= until) return spun_on(core, spinner);
            continue;
        }
        if (!holder) {
            leave_reader_behind(file.get(), path);
            holder = read_holder(file.get());
        }
        if (monotonic_now() >= until) return taken(core, *holder, root);
        block_until(monotonic_now() + kLookAgain);
    }
}

void CoreLock::write_holder() const {
    const std::string pid = std::to_string(::getpid());
    const std::time_t now = std::time(nullptr);
    std::tm utc{};
    ::gmtime_r(&now, &utc);
    std::array<char, 32> since{};
    std::strftime(since.data(), since.size(), "%Y-%m-%d %H:%M:%S UTC", &utc);
    const auto lines = text<std::string>("pid ", pid, "\nsince ", since.data(), "\nprogram ",
                                         printable(text_of_file("/proc/" + pid + "/comm"), 15), "\ncommand ",
                                         command_of(pid), '\n');
    // For people alone: if they cannot be written (another user's file), a message lacks them.
    static_cast<void>(::ftruncate(file_.descriptor(), 0) == 0 &&
                      ::pwrite(file_.descriptor(), lines.data(), lines.size(), 0) > 0);
}

}  // namespace qduino::board::linux
