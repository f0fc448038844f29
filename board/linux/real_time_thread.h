// What a thread needs to be real-time on stock Linux: a core, a priority, memory that is there, a
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
#include "posix/unique_fd.h"

namespace qduino::board::linux {

/// Error: invalid_argument when the core does not exist or this process may not use it.
Result<void> pin_to_core(int core);
/// SCHED_FIFO at `priority` (1…99). The threads and children that the caller makes are ordinary
/// ones. Error: not_permitted without CAP_SYS_NICE and without RLIMIT_RTPRIO.
Result<void> become_real_time(int priority);
/// Makes a thread of `stack_bytes` that runs `main(self)`. Error: unavailable, of `what`.
Result<pthread_t> make_thread(std::string_view what, std::size_t stack_bytes, void* (*main)(void*),
                              void* self);
/// A timer whose shots come as `signal` to the calling thread alone. Error: the system's.
Result<timer_t> make_thread_timer(int signal);
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
