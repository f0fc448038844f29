#include "board/linux/machine_settings.h"

#include <fcntl.h>
#include <sched.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "base/contract.h"
#include "board/linux/cpu_list.h"
#include "posix/small_file.h"
#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

using posix::read_small_file;
using posix::system_error;
using posix::UniqueFd;
using posix::write_small_file;
namespace {

constexpr std::string_view kHeader = "qduino-settings 1 ";
constexpr const char* kBootId = "/proc/sys/kernel/random/boot_id";

std::string_view without_newline(std::string_view text) {
    while (!text.empty() && (text.back() == '\n' || text.back() == '\0')) text.remove_suffix(1);
    return text;
}

std::string boot_id() {
    const auto text = read_small_file(kBootId);
    return text ? std::string{without_newline(*text)} : "?";
}

/// Opens and locks the state file. Error: unavailable when another process has it.
Result<UniqueFd> lock_state(const std::string& path, bool create) {
    UniqueFd file{::open(path.c_str(), O_RDWR | O_CLOEXEC | (create ? O_CREAT : 0), 0600)};
    if (!file.valid()) return system_error("open", path);
    if (::flock(file.get(), LOCK_EX | LOCK_NB) == 0) return file;
    if (errno != EWOULDBLOCK) return system_error("lock", path);
    return make_error(ErrorCode::unavailable,
                      "another sketch has changed the machine's settings and still runs");
}

std::string whole_file(int fd) {
    std::string text;
    std::array<char, 4096> part;
    for (off_t at = 0;; at = static_cast<off_t>(text.size())) {
        const ssize_t bytes = ::pread(fd, part.data(), part.size(), at);
        if (bytes <= 0) return text;
        text.append(part.data(), static_cast<std::size_t>(bytes));
    }
}

/// Moves every task of the cgroup to its parent and removes it. A group that is already gone is no
/// error.
Result<void> dissolve_group(const std::string& path) {
    if (::access(path.c_str(), F_OK) != 0) return {};
    const std::string parent = path.substr(0, path.rfind('/'));
    const bool second_version = ::access((path + "/cgroup.threads").c_str(), F_OK) == 0;
    const char* const list = second_version ? "/cgroup.threads" : "/tasks";
    if (second_version) static_cast<void>(write_small_file(path + "/cpuset.cpus.partition", "member"));
    for (int attempt = 0; attempt < 100; ++attempt) {
        const auto tasks = read_small_file(path + list);
        for (std::string_view rest = tasks ? std::string_view{*tasks} : ""; !rest.empty();) {
            const std::size_t end = rest.find('\n');
            // A task may have ended meanwhile.
            static_cast<void>(write_small_file(parent + list, rest.substr(0, end)));
            rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
        }
        if (::rmdir(path.c_str()) == 0) return {};
        if (errno != EBUSY) break;
        ::usleep(2000);  // a task that is on its way out still counts
    }
    return system_error("remove", path);
}

CpuList affinity_of(pid_t tid) {
    CpuList cpus;
    cpu_set_t set;
    CPU_ZERO(&set);
    if (::sched_getaffinity(tid, sizeof set, &set) != 0) return cpus;
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
        if (CPU_ISSET(static_cast<std::size_t>(cpu), &set)) cpus.add(cpu);
    }
    return cpus;
}

/// Field `number` (from 3 on) of /proc/<tid>/stat; empty when there is none. (Field 2, the name,
/// may hold anything.)
std::string stat_field(pid_t tid, int number) {
    const auto text = read_small_file("/proc/" + std::to_string(tid) + "/stat");
    if (!text) return {};
    std::size_t at = text->rfind(')');
    for (int field = 2; at != std::string::npos && field < number; ++field) at = text->find(' ', at + 1);
    if (at == std::string::npos) return {};
    return text->substr(at + 1, text->find(' ', at + 1) - at - 1);
}
int online_cpus() { return static_cast<int>(::sysconf(_SC_NPROCESSORS_ONLN)); }

constexpr int kFlags = 9;
constexpr int kStartTime = 22;
constexpr unsigned long kBoundByKernel = 0x04000000;  // PF_NO_SETAFFINITY, include/linux/sched.h

/// Cuts the part before the next tabulator off `text`.
std::string next_field(std::string_view& text) {
    const std::size_t tab = text.find('\t');
    const std::string field{text.substr(0, tab)};
    text = tab == std::string_view::npos ? std::string_view{} : text.substr(tab + 1);
    return field;
}

/// `rest` begins with tid and start time: the thread, if it is still the same one.
std::optional<pid_t> living_thread(std::string_view& rest) {
    const auto tid = static_cast<pid_t>(std::strtol(next_field(rest).c_str(), nullptr, 10));
    if (next_field(rest) != stat_field(tid, kStartTime)) return std::nullopt;
    return tid;
}

void bind(pid_t tid, const CpuList& cpus) {
    cpu_set_t set;
    CPU_ZERO(&set);
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
        if (cpus.has(cpu)) CPU_SET(static_cast<std::size_t>(cpu), &set);
    }
    ::sched_setaffinity(tid, sizeof set, &set);
}

/// `rest` is tid, start time, list of CPUs.
void undo_affinity(std::string_view rest) {
    const auto tid = living_thread(rest);
    const auto cpus = CpuList::from_list(rest);
    if (tid && cpus) bind(*tid, *cpus);
}

/// `rest` is tid, start time, policy, priority.
void undo_policy(std::string_view rest) {
    const auto tid = living_thread(rest);
    const int policy = std::atoi(next_field(rest).c_str());
    sched_param parameters{};
    parameters.sched_priority = std::atoi(std::string{rest}.c_str());
    if (tid) ::sched_setscheduler(*tid, policy, &parameters);
}

Result<void> undo_line(std::string_view line) {
    const std::size_t first = line.find('\t');
    // Cut short by a kill in the middle of a write: nothing was changed.
    if (first == std::string_view::npos) return {};
    const std::string_view kind = line.substr(0, first);
    const std::string_view rest = line.substr(first + 1);
    if (kind == "group") return dissolve_group(std::string{rest});
    if (kind == "affinity") return undo_affinity(rest), Result<void>{};
    if (kind == "policy") return undo_policy(rest), Result<void>{};
    const std::size_t second = rest.find('\t');
    if (kind != "write" || second == std::string_view::npos) return {};
    const std::string path{rest.substr(0, second)};
    if (::access(path.c_str(), F_OK) != 0) return {};  // the device has gone
    const std::string_view old = rest.substr(second + 1);
    // A kill between the record and the write leaves the old value. It is not written again: the
    // kernel may refuse any write there (an interrupt of a disk, whose cores the kernel manages).
    const auto now = read_small_file(path);
    if (now && without_newline(*now) == old) return {};
    return write_small_file(path, old.empty() ? "\n" : old);  // an empty write would reach nobody
}

/// Undoes all whole lines of `text`, the last first. A failure does not keep the rest from being
/// undone.
Result<void> undo_all(std::string_view text) {
    Result<void> first_failure;
    if (text.substr(0, kHeader.size()) != kHeader) return first_failure;
    const std::size_t body = text.find('\n');
    if (body == std::string_view::npos) return first_failure;
    const std::string_view boot = text.substr(kHeader.size(), body - kHeader.size());
    // The computer has booted since: there is nothing left to undo.
    if (boot != boot_id()) return first_failure;
    std::string_view lines = text.substr(body + 1);
    while (!lines.empty()) {
        const bool whole = lines.back() == '\n';
        if (whole) lines.remove_suffix(1);
        const std::size_t start = lines.rfind('\n');
        const std::string_view line = start == std::string_view::npos ? lines : lines.substr(start + 1);
        if (whole) {
            if (auto done = undo_line(line); !done && first_failure) first_failure = done;
        }
        lines = start == std::string_view::npos ? std::string_view{} : lines.substr(0, start + 1);
    }
    return first_failure;
}

}  // namespace

CpuList read_cpu_list(const std::string& path) {
    const auto text = read_small_file(path);
    return (text ? CpuList::from_list(*text) : std::nullopt).value_or(CpuList{});
}

MachineSettings::~MachineSettings() { static_cast<void>(undo()); }

Result<MachineSettings> MachineSettings::open(std::string path) {
    std::error_code ignored;
    std::filesystem::create_directories(std::filesystem::path{path}.parent_path(), ignored);
    auto file = lock_state(path, true);
    if (!file) return file.error();
    if (auto undone = undo_all(whole_file(file->get())); !undone) return undone.error();
    MachineSettings settings;
    settings.path_ = std::move(path);
    settings.file_ = std::move(*file);
    if (::ftruncate(settings.file_.get(), 0) != 0) return system_error("empty", settings.path_);
    if (auto begun = settings.record(std::string{kHeader} + boot_id()); !begun) return begun.error();
    return settings;
}

Result<void> MachineSettings::record(std::string_view line) {
    QDUINO_EXPECT(file_.valid());
    const std::string whole = std::string{line} + '\n';
    const off_t end = ::lseek(file_.get(), 0, SEEK_END);
    if (::pwrite(file_.get(), whole.data(), whole.size(), end) == static_cast<ssize_t>(whole.size()))
        return {};
    return system_error("write", path_);
}

Result<void> MachineSettings::change(const std::string& path, std::string_view text) {
    const auto before = read_small_file(path);
    if (!before) return before.error();
    const std::string_view old = without_newline(*before);
    if (old == text) return {};
    const off_t end = ::lseek(file_.get(), 0, SEEK_END);
    if (auto recorded = record("write\t" + path + "\t" + std::string{old}); !recorded) return recorded;
    auto written = write_small_file(path, text);
    if (!written) static_cast<void>(::ftruncate(file_.get(), end));  // refused: nothing to undo
    return written;
}

Result<void> MachineSettings::make_group(const std::string& path) {
    if (auto recorded = record("group\t" + path); !recorded) return recorded;
    if (::mkdir(path.c_str(), 0755) == 0 || errno == EEXIST) return {};
    return system_error("make", path);
}

Result<void> MachineSettings::record_affinity(pid_t tid, const CpuList& cpus) {
    return record("affinity\t" + std::to_string(tid) + "\t" + stat_field(tid, kStartTime) + "\t" +
                  cpus.to_list());
}

Result<void> MachineSettings::remember_affinity(pid_t tid) {
    const CpuList bound = affinity_of(tid);
    const bool by_kernel = (std::strtoul(stat_field(tid, kFlags).c_str(), nullptr, 10) & kBoundByKernel) != 0;
    if (bound.empty() || by_kernel || bound.size() >= online_cpus()) return {};
    return record_affinity(tid, bound);
}

Result<void> MachineSettings::schedule_thread(pid_t tid, int priority, int core) {
    sched_param parameters{};
    const int policy = ::sched_getscheduler(tid);
    if (policy < 0 || ::sched_getparam(tid, &parameters) != 0)
        return system_error("look at", "a kernel thread");
    if (auto recorded = record_affinity(tid, affinity_of(tid)); !recorded) return recorded;
    const auto recorded =
        record("policy\t" + std::to_string(tid) + "\t" + stat_field(tid, kStartTime) + "\t" +
               std::to_string(policy) + "\t" + std::to_string(parameters.sched_priority));
    if (!recorded) return recorded;
    CpuList only;
    only.add(core);
    bind(tid, only);
    parameters.sched_priority = priority;
    if (::sched_setscheduler(tid, SCHED_FIFO, &parameters) != 0)
        return system_error("schedule", "a kernel thread");
    return {};
}

Result<void> MachineSettings::undo() {
    if (!file_.valid()) return {};
    auto undone = undo_all(whole_file(file_.get()));
    if (undone) static_cast<void>(::ftruncate(file_.get(), 0));
    file_.reset();
    return undone;
}

Result<Restored> restore_settings(const std::string& path) {
    if (::access(path.c_str(), F_OK) != 0) return Restored::nothing_to_do;
    auto file = lock_state(path, false);
    if (!file) return file.error();
    const std::string text = whole_file(file->get());
    if (text.empty()) return Restored::nothing_to_do;
    if (auto undone = undo_all(text); !undone) return undone.error();
    if (::ftruncate(file->get(), 0) != 0) return system_error("empty", path);
    return Restored::undone;
}

}  // namespace qduino::board::linux
