#include "apps/launcher/first_screen.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>

#include "apps/launcher/run_log.h"
#include "base/text.h"
#include "base/whole_number.h"
#include "board/linux/kernel/kernel_text.h"
#include "posix/guarded_file.h"
#include "posix/system_error.h"
#include "posix/unique_fd.h"
#include "terminal/message.h"

namespace qduino::launcher {
namespace {

constexpr std::size_t kReportMost = 256 * 1024;

/// Does any process of a printer hold the lock on this folder (run_lock.h)?
bool runs_with(const std::filesystem::path& folder, uid_t owner) {
    const auto lock = posix::open_guarded(folder / "run.lock", O_RDONLY, owner);
    return lock && ::flock(lock->get(), LOCK_SH | LOCK_NB) != 0;
}

/// A path stays in one piece, so that it can be copied; a long one begins at the edge.
std::string path_line(const std::string& before, const std::string& path) {
    const bool fits = before.size() + path.size() <= apps::kColumns;
    return (fits ? before : before.substr(0, before.find_last_not_of(' ') + 1) + "\n") + path + "\n";
}

}  // namespace

std::string minutes_and_seconds(Nanoseconds length) {
    const std::int64_t seconds = (length + 1s - 1ns) / 1s;
    if (seconds < 60) return text<std::string>(seconds, " s");
    return text<std::string>(seconds / 60, " min ", seconds % 60, " s");
}

Nanoseconds age_of_this_process() {
    const std::string stat = board::linux::text_of_file("/proc/self/stat");
    const auto fields = board::linux::stat_fields(stat);
    constexpr std::size_t kStartField = 22 - 3;  // proc_pid_stat(5), in ticks since the boot
    timespec now{};
    const long ticks = ::sysconf(_SC_CLK_TCK);
    if (fields.size() <= kStartField || ticks <= 0 || ::clock_gettime(CLOCK_BOOTTIME, &now) != 0) return {};
    const auto start = whole_number<std::int64_t>(fields[kStartField]).value_or(0);
    const Nanoseconds since_boot = now.tv_sec * Nanoseconds{1s} + Nanoseconds{now.tv_nsec};
    return std::max(since_boot - start * (Nanoseconds{1s} / ticks), Nanoseconds{0});
}

std::string first_screen(const ScreenFacts& facts) {
    auto out = text<std::string>("Ready in ", minutes_and_seconds(facts.took), ". ", facts.where, '\n');
    if (!facts.machine.empty()) write(out, "Virtual printer: ", facts.machine.substr(0, 60), '\n');
    write(out, "\n  Open   ", facts.address, '\n');
    write(out, "  Slicer add it as OctoPrint or PrusaLink, with this address; the key is in\n");
    const std::string key = (facts.state / "api-key").native();
    write(out, key.size() + 9 <= apps::kColumns ? "         " : "", key, '\n');
    if (!facts.serial.empty()) out += path_line("  Serial ", facts.serial);
    write(out, "  Stop   Ctrl-C\n\n");
    out += apps::wrapped(text<std::string>("Guarantees: ", facts.guarantees, ", ", facts.budget), "");
    // ./run knows the usual folders, and has to be told of another.
    const bool usual = facts.state.filename() == "qduinomc";
    const auto more = text<std::string>("All of it: ./run --report", usual ? "" : " --state ",
                                        usual ? "" : facts.state.native(),
                                        "     Log: ", (facts.state / "run.log").native());
    if (more.size() <= apps::kColumns) return out + more + "\n";
    return out + "All of it: ./run --report, with the same --state     Log: run.log beside the key\n";
}

Result<std::string> kept_report(const std::filesystem::path& folder) {
    const std::filesystem::path path = folder / "report.txt";
    struct stat owner {};
    if (::lstat(folder.c_str(), &owner) != 0 && errno != ENOENT)
        return posix::system_error("look at", folder.native());
    // The service's user, or whoever started that printer.
    const Result<std::string> kept = posix::read_guarded(path, kReportMost, owner.st_uid);
    if (!kept && kept.error().code == ErrorCode::not_found)
        return make_error(ErrorCode::not_found, "no printer has run with ", folder.native(),
                          ": start one with ./run, or name its folder with --state");
    if (!kept) return kept.error();
    const char* now = runs_with(folder, owner.st_uid) ? "This printer runs now.\n"
                                                      : "No printer runs there now; the last one's:\n";
    return now + plain_lines(*kept);
}

}  // namespace qduino::launcher
