#include "board/linux/strangers.h"

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

constexpr std::size_t kTasksMax = 256;  // looked at in a sweep

int open_file(const FixedString<64>& path) { return ::open(path.view().data(), O_RDONLY | O_CLOEXEC); }

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
void Strangers::for_each_thread(const Function& function) const {
    alignas(8) std::array<std::byte, kTasksMax * 24> entries;
    ::lseek(folder_, 0, SEEK_SET);
    const long bytes = ::syscall(SYS_getdents64, folder_, entries.data(), entries.size());
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
    const auto path = text<FixedString<64>>("/proc/", sketch, "/task", '\0');
    folder_ = ::open(path.view().data(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    find_new(true);
}

void Strangers::find_new(bool known) {
    threads_ = thread_count();
    for_each_thread([&](pid_t tid) {
        if (wards_->has(tid) || std::ranges::find(strangers_, tid, &Stranger::tid) != strangers_.end())
            return;
        Stranger stranger;
        stranger.tid = tid;
        stranger.stat_file =
            open_file(text<FixedString<64>>("/proc/", sketch_, "/task/", tid, "/stat", '\0'));
        if (stranger.stat_file < 0) return;
        sched::ThreadTimes times;
        if (stranger.times.open(sketch_, tid) && stranger.times.read(times)) stranger.cpu = times.cpu;
        if (!strangers_.try_push_back(stranger)) {
            ::close(stranger.stat_file);
            stranger.times.close();
            return;
        }
        if (!known) ++fresh_;
    });
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
    for (Stranger& stranger : strangers_) {
        look_at(stranger);
        look_at_children(stranger.tid);
    }
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
    if (rank.ranked_itself()) return depose(stranger.tid, rank.name, StrangerKind::thread_ranked);
    if (!rank.lent()) return;
    const VcpuId lender = wards_->charge(rank.priority(), rank.core, used);
    StrangerFindings* const found = finding_of(stranger.tid, rank.name);
    if (lender == kNoVcpu || !found) return;
    found->cpu_ns += to_ns(used);
    found->lender = lender;
    found->kind = StrangerKind::lent;
}

void Strangers::look_at_children(pid_t tid) {
    const int list = open_file(text<FixedString<64>>("/proc/", sketch_, "/task/", tid, "/children", '\0'));
    if (list < 0) return;
    TaskText buffer;
    std::string_view children = read_anew(list, buffer);
    ::close(list);
    while (!children.empty()) {
        const auto child = whole_number<pid_t>(next_word(children));
        if (!child || *child == ::getpid() || wards_->has(*child)) continue;
        const int file = open_file(text<FixedString<64>>("/proc/", *child, "/stat", '\0'));
        if (file < 0) continue;
        TaskText text_of_child;
        const TaskRank rank = task_rank(read_anew(file, text_of_child));
        ::close(file);
        if (rank.ranked_itself()) depose(*child, rank.name, StrangerKind::process_ranked);
    }
}

// ---- what is done -------------------------------------------------------------------------------

/// It loses its priority, and is stopped for good: it would take the priority again. The first
/// thread is the process to others, and is not stopped.
void Strangers::depose(pid_t tid, std::string_view name, StrangerKind kind) {
    ++findings_->usurpers;
    if (StrangerFindings* const found = finding_of(tid, name)) found->kind = kind;
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
