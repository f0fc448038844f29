#include "board/linux/kernel/host_settings.h"

#include <fcntl.h>
#include <linux/capability.h>
#include <sched.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <optional>

#include "base/contract.h"
#include "base/whole_number.h"
#include "board/linux/kernel/closed_folder.h"
#include "board/linux/kernel/kernel_text.h"
#include "board/linux/kernel/real_time_thread.h"
#include "posix/guarded_file.h"
#include "posix/system_error.h"

namespace qduino::board::linux {

using posix::read_small_file;
using posix::system_error;
using posix::UniqueFd;
using posix::write_small_file;
namespace {

/// The first line of a state file of this boot.
std::string header() { return "qduino-settings 1 " + text_of_file("/proc/sys/kernel/random/boot_id"); }

/// Opens and locks the state file. Error: unavailable when another process has it.
Result<UniqueFd> lock_state(const std::string& path, bool create) {
    QDUINO_TRY_ASSIGN(UniqueFd file,
                      create ? posix::open_or_make_guarded(path, 0600) : posix::open_guarded(path, O_RDWR));
    if (::flock(file.get(), LOCK_EX | LOCK_NB) == 0) return file;
    if (errno != EWOULDBLOCK) return system_error("lock", path);
    return make_error(ErrorCode::unavailable,
                      "another sketch has changed the computer's settings and still runs");
}

std::string whole_file(int fd) {
    ::lseek(fd, 0, SEEK_SET);
    const auto text = posix::read_to_end(fd, "the state file");
    return text ? *text : std::string{};
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
        const std::string tasks = text_of_file(path + list);
        // A task may have ended meanwhile.
        for (const std::string_view task : words(tasks))
            static_cast<void>(write_small_file(parent + list, task));
        Result<void> removed = remove_folder_in_closed(path);
        if (removed || removed.error().code != ErrorCode::unavailable) return removed;
        ::usleep(2000);  // a task that is on its way out still counts
    }
    return remove_folder_in_closed(path);
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

/// Field `number` (from 3 on) of /proc/<tid>/stat; empty when there is none.
std::string stat_field(pid_t tid, std::size_t number) {
    const std::string stat = text_of_file("/proc/" + std::to_string(tid) + "/stat");
    const auto fields = stat_fields(stat);
    return number - 3 < fields.size() ? std::string{fields[number - 3]} : std::string{};
}

int online_cpus() { return static_cast<int>(::sysconf(_SC_NPROCESSORS_ONLN)); }

constexpr int kFlags = 9;
constexpr int kStartTime = 22;
constexpr unsigned long kBoundByKernel = 0x04000000;  // PF_NO_SETAFFINITY, include/linux/sched.h

/// `rest` begins with tid and start time: the thread, if it is still the same one.
std::optional<pid_t> living_thread(std::string_view& rest) {
    const auto tid = whole_number<pid_t>(cut(rest, '\t'));
    const std::string_view started = cut(rest, '\t');
    return tid && started == stat_field(*tid, kStartTime) ? tid : std::nullopt;
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
    const int policy = whole_number<int>(cut(rest, '\t')).value_or(0);
    sched_param parameters{};
    parameters.sched_priority = whole_number<int>(rest).value_or(0);
    if (tid) ::sched_setscheduler(*tid, policy, &parameters);
}

/// `rest` is path, old value.
Result<void> undo_write(std::string_view rest) {
    const std::string path{cut(rest, '\t')};
    if (::access(path.c_str(), F_OK) != 0) return {};  // the device has gone
    // A kill between the record and the write leaves the old value. It is not written again: the
    // kernel may refuse any write there (an interrupt of a disk, whose cores the kernel manages).
    const auto now = read_small_file(path);
    if (now && trimmed(*now) == rest) return {};
    return write_small_file(path, rest.empty() ? "\n" : rest);  // an empty write would reach nobody
}

Result<void> undo_line(std::string_view rest) {
    const std::string_view kind = cut(rest, '\t');
    if (kind == "group" && !rest.empty()) return dissolve_group(std::string{rest});
    if (kind == "affinity") undo_affinity(rest);
    if (kind == "policy") undo_policy(rest);
    // Another line was cut short by a kill in the middle of a write: nothing was changed.
    return kind == "write" && rest.find('\t') != std::string_view::npos ? undo_write(rest) : Result<void>{};
}

/// Undoes all whole lines of `text`, the last first. A failure does not keep the rest from being
/// undone.
Result<void> undo_all(std::string_view text) {
    // The text is of another boot: there is nothing left to undo.
    if (cut(text, '\n') != header()) return {};
    std::vector<std::string_view> lines;
    while (text.find('\n') != std::string_view::npos) lines.push_back(cut(text, '\n'));
    Result<void> first_failure;
    for (auto line = lines.rbegin(); line != lines.rend(); ++line) {
        if (const auto done = undo_line(*line); !done && first_failure) first_failure = done;
    }
    return first_failure;
}

}  // namespace

CpuList read_cpu_list(const std::string& path) {
    return CpuList::from_list(text_of_file(path)).value_or(CpuList{});
}

HostSettings::~HostSettings() { static_cast<void>(undo()); }

Result<HostSettings> HostSettings::open(std::string path) {
    std::error_code ignored;
    std::filesystem::create_directories(std::filesystem::path{path}.parent_path(), ignored);
    QDUINO_TRY_ASSIGN(UniqueFd file, lock_state(path, true));
    QDUINO_TRY(undo_all(whole_file(file.get())));
    HostSettings settings;
    settings.path_ = std::move(path);
    settings.file_ = std::move(file);
    if (::ftruncate(settings.file_.get(), 0) != 0) return system_error("empty", settings.path_);
    QDUINO_TRY(settings.record(header()));
    return settings;
}

template <typename... Pieces>
Result<void> HostSettings::record(const Pieces&... pieces) {
    QDUINO_EXPECT(file_.valid());
    ::lseek(file_.get(), 0, SEEK_END);
    return posix::write_all(file_.get(), text<std::string>(pieces..., '\n'), path_);
}

Result<void> HostSettings::change(const std::string& path, std::string_view text) {
    QDUINO_TRY_ASSIGN(const std::string before, read_small_file(path));
    const std::string_view old = trimmed(before);
    if (old == text) return {};
    const off_t end = ::lseek(file_.get(), 0, SEEK_END);
    QDUINO_TRY(record("write\t", path, '\t', old));
    auto written = write_small_file(path, text);
    if (!written) static_cast<void>(::ftruncate(file_.get(), end));  // refused: nothing to undo
    return written;
}

Result<void> HostSettings::make_group(const std::string& path) {
    QDUINO_TRY(record("group\t", path));
    Result<void> made = make_folder_in_closed(path);
    if (!made && made.error().code == ErrorCode::already_exists) return {};
    return made;
}

Result<void> HostSettings::record_affinity(pid_t tid, const CpuList& cpus) {
    return record("affinity\t", tid, '\t', stat_field(tid, kStartTime), '\t', cpus.to_list());
}

Result<void> HostSettings::remember_affinity(pid_t tid) {
    const CpuList bound = affinity_of(tid);
    const auto flags = whole_number<unsigned long>(stat_field(tid, kFlags)).value_or(0);
    const bool by_kernel = (flags & kBoundByKernel) != 0;
    if (bound.empty() || by_kernel || bound.size() >= online_cpus()) return {};
    return record_affinity(tid, bound);
}

Result<void> HostSettings::take_thread(pid_t tid, int core) {
    if (!has_capability(CAP_SYS_NICE))
        return make_error(ErrorCode::not_permitted, "to rank a kernel thread, run as root");
    sched_param parameters{};
    const int policy = ::sched_getscheduler(tid);
    if (policy < 0 || ::sched_getparam(tid, &parameters) != 0)
        return system_error("look at", "a kernel thread");
    QDUINO_TRY(record_affinity(tid, affinity_of(tid)));
    QDUINO_TRY(record("policy\t", tid, '\t', stat_field(tid, kStartTime), '\t', policy, '\t',
                      parameters.sched_priority));
    CpuList only;
    only.add(core);
    bind(tid, only);
    return {};
}

Result<void> HostSettings::undo() {
    if (!file_.valid()) return {};
    auto undone = undo_all(whole_file(file_.get()));
    if (undone) static_cast<void>(::ftruncate(file_.get(), 0));
    file_.reset();
    return undone;
}

Result<Restored> restore_settings(const std::string& path) {
    if (::access(path.c_str(), F_OK) != 0) return Restored::nothing_to_do;
    QDUINO_TRY_ASSIGN(const UniqueFd file, lock_state(path, false));
    const std::string text = whole_file(file.get());
    if (text.empty()) return Restored::nothing_to_do;
    QDUINO_TRY(undo_all(text));
    if (::ftruncate(file.get(), 0) != 0) return system_error("empty", path);
    return Restored::undone;
}

}  // namespace qduino::board::linux
