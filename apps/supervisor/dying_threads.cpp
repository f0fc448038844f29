#include "apps/supervisor/dying_threads.h"

#include <sched.h>

#include <optional>
#include <string>

#include "base/text.h"
#include "base/time.h"
#include "base/whole_number.h"
#include "board/linux/kernel/deadline_class.h"
#include "board/linux/kernel/importance.h"
#include "board/linux/kernel/kernel_text.h"

namespace qduino::supervisor {
namespace {

/// Field 39 of proc_pid_stat(5); stat_fields() begins with field 3.
constexpr std::size_t kCoreField = 39 - 3;

template <typename Function>
void for_each_thread(pid_t process, const Function& function) {
    const auto folder = text<std::string>("/proc/", process, "/task/");
    for (const std::string& name : board::linux::entries(folder)) {
        if (const auto tid = whole_number<pid_t>(name)) function(*tid, folder + name + "/stat");
    }
}

/// The core that a thread stands on.
std::optional<unsigned> core_of(const std::string& stat_file) {
    const std::string stat = board::linux::text_of_file(stat_file);
    const auto fields = board::linux::stat_fields(stat);
    return fields.size() > kCoreField ? whole_number<unsigned>(fields[kCoreField]) : std::nullopt;
}

/// Before every SCHED_FIFO task, and for half of the time at most. The kernel gives it to a thread
/// that may use all cores of its domain: one in a cpuset of its own core may.
bool go_before_all(pid_t tid) { return board::linux::give_deadline_class(tid, 50ms, 100ms) == 0; }

void go_above_the_loops(pid_t tid) {
    sched_param parameters{};
    parameters.sched_priority = importance::kSupervisorPriority - 2;
    ::sched_setscheduler(tid, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters);
}

}  // namespace

void let_threads_die(pid_t process, bool raise) {
    cpu_set_t own;
    CPU_ZERO(&own);
    const bool known = ::sched_getaffinity(0, sizeof own, &own) == 0;
    for_each_thread(process, [&](pid_t tid, const std::string& stat_file) {
        bool left = false;
        if (const auto core = known ? core_of(stat_file) : std::nullopt; core && *core < CPU_SETSIZE) {
            cpu_set_t others = own;
            CPU_CLR(*core, &others);
            left = CPU_COUNT(&others) > 0 && ::sched_setaffinity(tid, sizeof others, &others) == 0;
        }
        if (raise && (left || !go_before_all(tid))) go_above_the_loops(tid);
        if (known) ::sched_setaffinity(tid, sizeof own, &own);
    });
}

void lower_threads(pid_t process) {
    for_each_thread(process, [](pid_t tid, const std::string&) {
        const sched_param ordinary{};
        ::sched_setscheduler(tid, SCHED_OTHER | SCHED_RESET_ON_FORK, &ordinary);
    });
}

}  // namespace qduino::supervisor
