#include "board/linux/kernel/importance.h"

#include <linux/capability.h>
#include <sched.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>

#include "board/linux/kernel/real_time_thread.h"

namespace qduino::importance {
namespace {

volatile sig_atomic_t g_spent = 0;
bool g_limited = false;
rlimit g_limit_before{};

extern "C" void on_budget_spent(int) {
    g_spent = 1;
    step_down();
}

rlim_t microseconds(Nanoseconds length) { return static_cast<rlim_t>(to_ns(length) / 1000); }

void set_budget() {
    struct sigaction action {};
    action.sa_handler = on_budget_spent;
    action.sa_flags = SA_RESTART;
    sigemptyset(&action.sa_mask);
    ::sigaction(SIGXCPU, &action, nullptr);
    if (!g_limited) g_limited = ::getrlimit(RLIMIT_RTTIME, &g_limit_before) == 0;
    if (!g_limited) return;
    rlimit limit = g_limit_before;
    // The sketch inherits a lowered hard limit; only with this can it raise the limit again.
    if (board::linux::has_capability(CAP_SYS_RESOURCE))
        limit.rlim_max = std::min(limit.rlim_max, microseconds(kHardLimit));
    limit.rlim_cur = std::min(limit.rlim_max, microseconds(kBudget));
    ::setrlimit(RLIMIT_RTTIME, &limit);
}

}  // namespace

void rise(int priority) {
    set_budget();
    g_spent = 0;
    sched_param parameters{};
    parameters.sched_priority = priority;
    ::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters);
    static_cast<void>(board::linux::lock_memory());
}

// The flag stays: a process that may not take it away would be refused the whole call.
void step_down() {
    const sched_param ordinary{};
    ::sched_setscheduler(0, SCHED_OTHER | SCHED_RESET_ON_FORK, &ordinary);
}

bool budget_was_spent() { return g_spent != 0; }

void restore_real_time_limit() {
    if (g_limited) ::setrlimit(RLIMIT_RTTIME, &g_limit_before);
}

}  // namespace qduino::importance
