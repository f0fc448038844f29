// What a thread needs to be real-time on stock Linux: a core, a priority, memory that is in RAM, a
// name.
//
// Each call does one thing to the calling thread and returns whether it worked. A refusal becomes a
// line of the guarantee report and is never silent.
#pragma once

#include <pthread.h>
#include <time.h>

#include <string>
#include <string_view>

#include "base/result.h"
#include "base/time.h"
#include "board/linux/kernel/clock.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

/// Error: invalid_argument when the core does not exist or this process may not use it.
Result<void> pin_to_core(int core);
/// Lets another thread run on every core: it may wait for one that somebody of higher rank has.
void widen(pthread_t thread);
/// Waits until `done()`; `wait(until)` may return early. From `limit` on `free()` is called every
/// 20 ms: a thread that has not come to its pin_to_core() yet goes back to that core. False when it
/// was called. Gives up 10 s later.
template <typename Done, typename Wait, typename Free>
bool wait_or_free(Done done, Instant limit, Wait wait, Free free) {
    while (!done() && monotonic_now() < limit) wait(limit);
    if (done()) return true;
    for (int i = 0; i < 500 && !done(); ++i) {
        free();
        wait(monotonic_now() + 20ms);
    }
    return false;
}
/// SCHED_FIFO at `priority` (1…99). The threads and children that the caller makes are ordinary
/// ones. Error: not_permitted without CAP_SYS_NICE and without RLIMIT_RTPRIO.
Result<void> become_real_time(int priority);
/// Makes a thread of `stack_bytes` that runs `main(self)`. Error: unavailable, of `what`.
Result<pthread_t> make_thread(std::string_view what, std::size_t stack_bytes, void* (*main)(void*),
                              void* self);
/// A timer whose shots come as `signal` to the calling thread alone. Error: the system's.
Result<timer_t> make_thread_timer(int signal);
/// Has the kernel wake the calling thread at its alarm, and not up to some time later to spare
/// wake-ups. An ordinary thread inherits that time from whoever started the program
/// (PR_SET_TIMERSLACK of prctl(2)); a real-time one has none.
void wake_on_time();
/// Why become_real_time() is refused here, and the cure; and the quota that an ordinary task has
/// here. `root` precedes /proc (tests).
[[nodiscard]] FixedString<200> why_no_real_time(const std::string& root = "");
/// RLIMIT_RTTIME: a real-time thread that has computed for so long without a wait dies by SIGKILL.
/// Lifts the limit where that is allowed. Error: out_of_range, when what stays is shorter than
/// `longest`, and this process may have real-time threads.
Result<void> lift_real_time_limit(Nanoseconds longest);
/// The name in ps and top, cut to 15 bytes.
void name_thread(std::string_view name);
/// Touches the whole rest of the calling thread's stack, so that none of it faults later.
void touch_stack();
/// Keeps every page that the process has or will have in memory. Error: not_permitted.
Result<void> lock_memory();
/// Keeps idle cores ready instead of asleep, as long as the result is open: a wake-up from sleep
/// costs tens of microseconds. The kernel forgets it with the process
/// (Documentation/power/pm_qos_interface.rst). `root` precedes /dev (tests). Error: not_permitted,
/// not_found.
Result<posix::UniqueFd> keep_cores_awake(const std::string& root = "");
/// The calling process may do what `capability` (a CAP_… of linux/capability.h) stands for.
bool has_capability(int capability);
/// CPUs of this computer, from 0 on; those that are offline count too.
int cpu_count();

}  // namespace qduino::board::linux
