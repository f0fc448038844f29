// SCHED_DEADLINE, the kernel's constant-bandwidth server: runs before every priority of SCHED_FIFO,
// for a runtime in each period (Documentation/scheduler/sched-deadline.rst).
#pragma once

#include <sys/syscall.h>
#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>

#include "base/time.h"

namespace qduino::board::linux {

/// As sched_setattr(2) lays it out; glibc has none before 2.41, and the kernel's header clashes
/// with glibc's.
struct DeadlineAttributes {
    std::uint32_t size = sizeof(DeadlineAttributes);
    std::uint32_t policy = 6;  ///< SCHED_DEADLINE
    std::uint64_t flags = 1;   ///< SCHED_FLAG_RESET_ON_FORK
    std::int32_t nice = 0;
    std::uint32_t priority = 0;
    std::uint64_t runtime_ns = 0;
    std::uint64_t deadline_ns = 0;
    std::uint64_t period_ns = 0;
};
static_assert(sizeof(DeadlineAttributes) == 48);

/// Gives the thread `tid` (0: the calling one) `runtime` in each `period`. Needs root. Returns 0 or
/// errno: EPERM also for a thread that may not use all cores of its scheduling domain, EBUSY when
/// no bandwidth is free.
inline int give_deadline_class(pid_t tid, Nanoseconds runtime, Nanoseconds period) {
    DeadlineAttributes attributes;
    attributes.runtime_ns = static_cast<std::uint64_t>(to_ns(runtime));
    attributes.deadline_ns = attributes.period_ns = static_cast<std::uint64_t>(to_ns(period));
    return ::syscall(SYS_sched_setattr, tid, &attributes, 0) == 0 ? 0 : errno;
}

}  // namespace qduino::board::linux
