#include "board/linux/core_rivals.h"

#include <dirent.h>
#include <sched.h>
#include <unistd.h>

#include <cstdlib>
#include <memory>
#include <sstream>
#include <vector>

#include "board/linux/clock.h"
#include "board/linux/machine_settings.h"
#include "posix/small_file.h"

#ifndef SCHED_DEADLINE
#define SCHED_DEADLINE 6
#endif

namespace qduino::board::linux {

using posix::read_small_file;
namespace {

/// One look at one task.
struct Look {
    CoreRival task;
    bool runnable = false;
    int core = 0;
    unsigned long long ticks = 0;  ///< of CPU time, in user space and in the kernel
};

/// The numbered entries of a folder.
std::vector<pid_t> numbers_in(const std::string& folder) {
    std::vector<pid_t> numbers;
    const std::unique_ptr<DIR, int (*)(DIR*)> entries{::opendir(folder.c_str()), &::closedir};
    if (!entries) return numbers;
    while (const dirent* entry = ::readdir(entries.get())) {
        char* end = nullptr;
        const long number = std::strtol(entry->d_name, &end, 10);
        if (end != entry->d_name && *end == '\0') numbers.push_back(static_cast<pid_t>(number));
    }
    return numbers;
}

/// "TID (name) S field4 field5 …". The name may have spaces and brackets in it, and nothing behind
/// its last bracket has any.
std::optional<Look> look_at(pid_t pid, pid_t tid, const std::string& root) {
    const auto text =
        read_small_file(root + "/proc/" + std::to_string(pid) + "/task/" + std::to_string(tid) + "/stat");
    if (!text) return std::nullopt;  // it has ended
    const std::size_t open = text->find('('), close = text->rfind(')');
    if (open == std::string::npos || close == std::string::npos || close < open) return std::nullopt;
    Look look;
    look.task.pid = pid;
    look.task.tid = tid;
    look.task.name = text->substr(open + 1, close - open - 1);
    std::istringstream words{text->substr(close + 1)};
    std::string word;
    for (int field = 3; field <= 41 && words >> word; ++field) {
        const auto number = std::strtoull(word.c_str(), nullptr, 10);
        if (field == 3) look.runnable = word == "R";
        if (field == 14 || field == 15) look.ticks += number;
        if (field == 39) look.core = static_cast<int>(number);
        if (field == 40) look.task.priority = static_cast<int>(number);
        if (field == 41) look.task.policy = static_cast<int>(number);
    }
    return look;
}

bool goes_before(const CoreRival& task, int priority) {
    if (task.policy == SCHED_DEADLINE) return true;
    return (task.policy == SCHED_FIFO || task.policy == SCHED_RR) && task.priority >= priority;
}

std::vector<Look> candidates(const RivalSearch& search) {
    std::vector<Look> found;
    for (const pid_t pid : numbers_in(search.root + "/proc")) {
        if (pid == search.not_of || pid == ::getpid()) continue;
        for (const pid_t tid : numbers_in(search.root + "/proc/" + std::to_string(pid) + "/task")) {
            const auto look = look_at(pid, tid, search.root);
            if (look && look->core == search.core && goes_before(look->task, search.priority))
                found.push_back(*look);
        }
    }
    return found;
}

std::string text_of(const CoreRival& rival, int core) {
    const bool deadline = rival.policy == SCHED_DEADLINE;
    return "core " + std::to_string(core) + " was taken by " + rival.name + " (pid " +
           std::to_string(rival.pid) + ", " +
           (deadline                   ? "SCHED_DEADLINE"
            : rival.policy == SCHED_RR ? "SCHED_RR "
                                       : "SCHED_FIFO ") +
           (deadline ? "" : std::to_string(rival.priority)) + ")";
}

}  // namespace

std::optional<CoreRival> find_core_rival(const RivalSearch& search) {
    const std::vector<Look> before = candidates(search);
    if (before.empty()) return std::nullopt;
    if (search.wait) {
        search.wait();
    } else {
        block_until(monotonic_now() + 50ms);
    }
    std::optional<CoreRival> most;
    unsigned long long most_ticks = 0;
    for (const Look& first : before) {
        const auto second = look_at(first.task.pid, first.task.tid, search.root);
        if (!second || second->core != search.core || second->ticks < first.ticks) continue;
        const unsigned long long ran = second->ticks - first.ticks;
        // A tick is 10 ms: a task that waits for its turn may show none.
        if (ran == 0 && !(first.runnable && second->runnable)) continue;
        if (most && ran <= most_ticks) continue;
        most = second->task;
        most_ticks = ran;
    }
    return most;
}

std::string who_took_the_core_of(board::VcpuId vcpu, const PinsLayout& layout, pid_t sketch,
                                 const std::string& root) {
    if (vcpu >= kVcpuLimit) return {};
    const LoopPlace place = LoopPlace::from(layout.heartbeats[vcpu].place.load(std::memory_order_relaxed));
    if (!place.known()) return {};
    const auto rival = find_core_rival(
        {.core = place.core, .priority = place.priority, .not_of = sketch, .root = root, .wait = {}});
    return rival ? text_of(*rival, place.core) : std::string{};
}

}  // namespace qduino::board::linux
