#include "board/linux/loop/strangers.h"

#include <dirent.h>
#include <fcntl.h>
#include <sched.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>

#include "base/fixed_string.h"
#include "base/text.h"
#include "base/whole_number.h"

namespace qduino::board::linux {
namespace {

constexpr std::size_t kTasksMax = 256;  // of a process, looked at in a sweep
/// From so many on that made themselves real-time, whoever makes them is to be stopped, too.
constexpr int kDeposedMax = 2;

int open_file(const FixedString<64>& path) { return ::open(path.view().data(), O_RDONLY | O_CLOEXEC); }

int open_folder(pid_t process) {
    const auto path = text<FixedString<64>>("/proc/", process, "/task", '\0');
    return ::open(path.view().data(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
}

std::string_view next_word(std::string_view& text) {
    const std::size_t end = std::min(text.find_first_of(" \n"), text.size());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    return word;
}

}  // namespace

// ---- what the kernel tells ----------------------------------------------------------------------

bool TaskRank::ranked_itself() const {
    return policy == SCHED_FIFO || policy == SCHED_RR || policy == SCHED_DEADLINE;
}

TaskRank task_rank(std::string_view stat) {
    // Fields of proc_pid_stat(5):
    constexpr int kFirst = 3, kPriority = 18, kCore = 39, kPolicy = 41;
    TaskRank rank;
    const std::size_t open = stat.find('('), close = stat.rfind(')');
    if (open == std::string_view::npos || close == std::string_view::npos || close < open) return rank;
    rank.name = stat.substr(open + 1, close - open - 1);
    std::string_view rest = stat.substr(std::min(close + 2, stat.size()));
    for (int field = kFirst; field <= kPolicy && !rest.empty(); ++field) {
        const int value = whole_number<int>(next_word(rest)).value_or(0);
        if (field == kPriority) rank.effective = value;
        if (field == kCore) rank.core = value;
        if (field == kPolicy) rank.policy = value;
    }
    return rank;
}

// ---- who there is -------------------------------------------------------------------------------

template <typename Function>
void Strangers::for_each_thread(int folder, const Function& function) {
    alignas(8) std::array<std::byte, kTasksMax * 24> entries;
    ::lseek(folder, 0, SEEK_SET);
    const long bytes = ::syscall(SYS_getdents64, folder, entries.data(), entries.size());
    for (long at = 0; at < bytes;) {
        // linux_dirent64 of getdents64(2): inode, offset, the length of the entry, type, name.
        const std::byte* entry = entries.data() + at;
        const auto* name = reinterpret_cast<const char*>(entry + 19);
        if (const auto tid = whole_number<pid_t>(std::string_view{name})) function(*tid);
        at += *reinterpret_cast<const std::uint16_t*>(entry + 16);
    }
}

/// A folder of the kernel's has a link for each folder in it, one for each thread here.
unsigned long Strangers::thread_count() const {
    struct stat folder {};
    return ::fstat(folder_, &folder) == 0 ? folder.st_nlink : 0;
}

void Strangers::open(pid_t sketch, bool grows, WardenFindings& findings, Wards& wards) {
    sketch_ = sketch;
    grows_ = grows;
    findings_ = &findings;
    wards_ = &wards;
    folder_ = open_folder(sketch);
    find_new(true);
}

/// Breadth first: the threads of the sketch, those of its children, and so on.
void Strangers::find_new(bool known) {
    threads_ = thread_count();
    Processes processes;
    find_in(folder_, sketch_, known, processes);
    for (std::size_t i = 0; i < processes.size(); ++i) {
        const int folder = open_folder(processes[i]);
        if (folder < 0) continue;
        find_in(folder, processes[i], known, processes);
        ::close(folder);
    }
}

void Strangers::find_in(int folder, pid_t process, bool known, Processes& processes) {
    for_each_thread(folder, [&](pid_t tid) {
        const bool is_ward = wards_->has(tid);
        if (!is_ward) meet(process, tid, known);
        // A classic loop is the only kind of ward that may start processes.
        if (!is_ward || grows_) add_children(process, tid, processes);
    });
}

void Strangers::meet(pid_t process, pid_t tid, bool known) {
    if (std::ranges::find(strangers_, tid, &Stranger::tid) != strangers_.end()) return;
    Stranger stranger;
    stranger.process = process;
    stranger.tid = tid;
    stranger.stat_file = open_file(text<FixedString<64>>("/proc/", process, "/task/", tid, "/stat", '\0'));
    if (stranger.stat_file < 0) return;
    sched::ThreadTimes times;
    if (stranger.times.open(process, tid) && stranger.times.read(times)) stranger.cpu = times.cpu;
    if (!strangers_.try_push_back(stranger)) {
        ::close(stranger.stat_file);
        stranger.times.close();
        return;
    }
    if (!known && process == sketch_) ++fresh_;
}

/// The warden itself is a child of the sketch, and so may be who works on a budget.
void Strangers::add_children(pid_t process, pid_t tid, Processes& processes) const {
    const int list = open_file(text<FixedString<64>>("/proc/", process, "/task/", tid, "/children", '\0'));
    if (list < 0) return;
    TaskText buffer;
    std::string_view children = read_anew(list, buffer);
    ::close(list);
    while (!children.empty()) {
        const auto child = whole_number<pid_t>(next_word(children));
        if (!child || *child == ::getpid() || wards_->has(*child)) continue;
        static_cast<void>(processes.try_push_back(*child));
    }
}

/// The first thread is the board's own once the loops run, and alone it is no stranger.
bool Strangers::are_watched() const {
    return grows_ ||
           std::ranges::any_of(strangers_, [&](const Stranger& each) { return each.tid != sketch_; });
}

// ---- looks --------------------------------------------------------------------------------------

void Strangers::look(Instant now) {
    if (thread_count() != threads_) return sweep(now);
    for (Stranger& stranger : strangers_) look_at(stranger);
    next_look_ = are_watched() ? now + kLookEvery : kForever;
}

void Strangers::sweep(Instant now) {
    find_new(false);
    // clang 14 has no std::ranges::remove_if of the other compiler's library.
    auto* const last =
        std::remove_if(strangers_.begin(), strangers_.end(), [](const Stranger& each) { return each.gone; });
    while (strangers_.end() != last) strangers_.pop_back();
    for (Stranger& stranger : strangers_) look_at(stranger);
    findings_->strangers = std::max<std::uint32_t>(findings_->strangers, fresh_);
    next_look_ = are_watched() ? now + kLookEvery : kForever;
}

void Strangers::look_at(Stranger& stranger) {
    TaskText buffer;
    const std::string_view stat = read_anew(stranger.stat_file, buffer);
    sched::ThreadTimes times;
    if (stat.empty() || !stranger.times.read(times)) {
        if (!stranger.gone) {
            ::close(stranger.stat_file);
            stranger.times.close();
        }
        stranger.gone = true;
        return;
    }
    const Nanoseconds used = times.cpu - stranger.cpu;
    stranger.cpu = times.cpu;
    const TaskRank rank = task_rank(stat);
    if (rank.ranked_itself()) return depose(stranger, rank.name);
    if (!rank.lent()) return;
    const VcpuId lender = wards_->charge(rank.priority(), rank.core, used);
    StrangerFindings* const found = finding_of(stranger.tid, rank.name);
    if (lender == kNoVcpu || !found) return;
    found->cpu_ns += to_ns(used);
    found->lender = lender;
    found->kind = StrangerKind::lent;
}

// ---- what is done -------------------------------------------------------------------------------

/// It loses its priority, and is stopped for good: it would take the priority again.
void Strangers::depose(const Stranger& stranger, std::string_view name) {
    ++findings_->usurpers;
    ++deposed_;
    if (StrangerFindings* const found = finding_of(stranger.tid, name))
        found->kind =
            stranger.process == sketch_ ? StrangerKind::thread_ranked : StrangerKind::process_ranked;
    hold_for_good(stranger.tid);
    if (deposed_ < kDeposedMax) return;
    for (const Stranger& each : strangers_) hold_for_good(each.tid);
    findings_->all_stopped = true;
}

/// The first thread is the process to others, and is not stopped.
void Strangers::hold_for_good(pid_t tid) {
    const auto held =
        std::ranges::find_if(held_, [&](const HeldThread& each) { return each.place().tid == tid; });
    if (tid == sketch_ || held != held_.end() || !held_.try_push_back(HeldThread{{tid, 0, 0}}))
        return HeldThread::demote(tid);
    held_.back().hold();
}

/// Null: more were named already than there is room for.
StrangerFindings* Strangers::finding_of(pid_t tid, std::string_view name) {
    for (StrangerFindings& each : findings_->named) {
        if (each.kind == StrangerKind::none) {
            each.tid = tid;
            const std::size_t length = std::min(name.size(), each.name.size() - 1);
            std::copy_n(name.begin(), length, each.name.begin());
            each.name[length] = '\0';
            return &each;
        }
        if (each.tid == tid) return &each;
    }
    return nullptr;
}

void Strangers::changed(pid_t tid, int status) {
    for (HeldThread& held : held_) {
        if (held.place().tid == tid) held.changed(status);
    }
}

}  // namespace qduino::board::linux
