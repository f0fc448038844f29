#include "board/linux/kernel/core_rivals.h"

#include <sched.h>
#include <unistd.h>

#include <algorithm>

#include "base/text.h"
#include "base/whole_number.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/kernel_text.h"
#include "board/linux/kernel/shared_file.h"

#ifndef SCHED_DEADLINE
#define SCHED_DEADLINE 6
#endif

namespace qduino::board::linux {

namespace {

constexpr Nanoseconds kBetweenLooks = 50ms;
constexpr Nanoseconds kTick = 10ms;  // of /proc, on every Linux: USER_HZ is 100

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
    for (const std::string& name : entries(folder)) {
        if (const auto number = whole_number<pid_t>(name)) numbers.push_back(*number);
    }
    return numbers;
}

/// "TID (name) S field4 field5 …". The name may have spaces and brackets in it.
std::optional<Look> look_at(pid_t pid, pid_t tid, const std::string& root) {
    const std::string stat = text_of_file(text<std::string>(root, "/proc/", pid, "/task/", tid, "/stat"));
    const std::size_t open = stat.find('('), close = stat.rfind(')');
    const auto fields = stat_fields(stat);
    if (open >= close || fields.size() < 39) return std::nullopt;  // it has ended
    const auto field = [&](std::size_t number) {
        return whole_number<unsigned long long>(fields[number - 3]).value_or(0);
    };
    return Look{.task = {.pid = pid,
                         .tid = tid,
                         .name = stat.substr(open + 1, close - open - 1),
                         .policy = static_cast<int>(field(41)),
                         .priority = static_cast<int>(field(40))},
                .runnable = fields[0] == "R",
                .core = static_cast<int>(field(39)),
                .ticks = field(14) + field(15)};
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

/// "stress-ng (pid 4711, SCHED_FIFO 85)". The name is the task's own choice.
std::string name_of(const CoreRival& rival) {
    const std::string_view policy = rival.policy == SCHED_DEADLINE ? "SCHED_DEADLINE"
                                    : rival.policy == SCHED_RR     ? "SCHED_RR "
                                                                   : "SCHED_FIFO ";
    return text<std::string>(printable(rival.name, 15), " (pid ", rival.pid, ", ", policy,
                             rival.policy == SCHED_DEADLINE ? "" : std::to_string(rival.priority), ")");
}

std::string taken_by(const CoreRival& rival, int core) {
    return text<std::string>("core ", core, " was taken by ", name_of(rival));
}

}  // namespace

std::optional<CoreRival> find_core_rival(const RivalSearch& search) {
    const std::vector<Look> before = candidates(search);
    if (before.empty()) return std::nullopt;
    if (search.wait) {
        search.wait();
    } else {
        block_until(monotonic_now() + kBetweenLooks);
    }
    std::optional<CoreRival> most;
    unsigned long long most_ticks = 0;
    for (const Look& first : before) {
        const auto second = look_at(first.task.pid, first.task.tid, search.root);
        if (!second || second->core != search.core || second->ticks < first.ticks) continue;
        const unsigned long long ran = second->ticks - first.ticks;
        // A tick is 10 ms. One may be a moment of work of somebody who wakes often, as a supervisor
        // does; a task that waits for its turn may show none.
        if (ran < 2 && !(first.runnable && second->runnable)) continue;
        if (most && ran <= most_ticks) continue;
        most = second->task;
        most->ran = static_cast<std::int64_t>(ran) * kTick;
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
    return rival ? taken_by(*rival, place.core) : std::string{};
}

std::string who_took_a_core_of(const PinsLayout& layout, pid_t sketch, const std::string& root) {
    std::vector<LoopPlace> places;  // of each core the lowest loop: most tasks go before that
    for (const Heartbeat& beat : layout.heartbeats) {
        const LoopPlace place = LoopPlace::from(beat.place.load(std::memory_order_relaxed));
        if (!place.known()) continue;
        const auto same = std::ranges::find(places, place.core, &LoopPlace::core);
        if (same == places.end()) {
            places.push_back(place);
        } else {
            same->priority = std::min(same->priority, place.priority);
        }
    }
    for (const LoopPlace& place : places) {
        const auto rival = find_core_rival(
            {.core = place.core, .priority = place.priority, .not_of = sketch, .root = root, .wait = {}});
        if (rival) return taken_by(*rival, place.core);
    }
    return {};
}

std::string who_spins_on(int core, pid_t not_of, const std::string& root) {
    // The kernel's limit stops it for 50 ms of each second, and the host whenever it likes.
    constexpr int kLooks = 3;
    for (int look = 0; look < kLooks; ++look) {
        const auto rival =
            find_core_rival({.core = core, .priority = 1, .not_of = not_of, .root = root, .wait = {}});
        if (!rival) break;
        if (rival->ran + kTick >= kBetweenLooks) return name_of(*rival);
    }
    return {};
}

}  // namespace qduino::board::linux
