// Locks between loops on stock Linux: the kernel's priority-inheriting futexes (futex(2);
// Documentation/locking/pi-futex.rst).
//
//   free, nobody waits    one compare-and-swap each way, in user space
//   held                  FUTEX_LOCK_PI: the kernel lends the holder the waiter's priority, through
//                         chains, until unlock
//
// The wait is announced to the budget, so that it costs none; the hold is, so that the holder is
// not put to sleep for its budget while others wait for it (budget_keeper.h). It works as well
// between threads without SCHED_FIFO, where it orders nothing and excludes all the same.
#include <sys/syscall.h>
#include <unistd.h>

#include "base/contract.h"
#include "board/linux/kernel/cycle_clock.h"
#include "board/linux/kernel/futex.h"
#include "board/linux/linux_board.h"
#include "board/linux/loop/announced_wait.h"

namespace qduino::board::linux {
namespace {

/// On a kernel without priority-inheriting futexes (CONFIG_FUTEX_PI) a waiter looks again so often.
constexpr Nanoseconds kRetry = 20us;

std::uint32_t own_value() {
    const VcpuThread* self = VcpuThread::current();
    return static_cast<std::uint32_t>(self ? self->tid() : static_cast<pid_t>(::syscall(SYS_gettid)));
}

bool take(LockWord& word) {
    std::uint32_t free = 0;
    const bool taken = word.value.compare_exchange_strong(free, own_value(), std::memory_order_acquire,
                                                          std::memory_order_relaxed);
    // What the holder writes to pins is later than what the last one wrote: cycle_clock.h.
    finish_loads();
    return taken;
}

}  // namespace

bool LinuxBoard::try_lock(LockWord& word) {
    VcpuThread* self = VcpuThread::current();
    if (self) self->begin_hold();
    const bool taken = take(word);
    if (self && !taken) self->end_hold();
    return taken;
}

void LinuxBoard::lock(LockWord& word) {
    if (VcpuThread* self = VcpuThread::current()) self->begin_hold();
    if (take(word)) return;
    const AnnouncedWait wait;
    const int error = futex_lock_inheriting(word.value);
    while (error == ENOSYS && !take(word)) block_until(monotonic_now() + kRetry);
    // EDEADLK: held by the caller, or a cycle of waits. ESRCH: by a thread that has ended.
    QDUINO_EXPECT(error == 0 || error == ENOSYS);
}

void LinuxBoard::unlock(LockWord& word) {
    std::uint32_t mine = own_value();
    if (!word.value.compare_exchange_strong(mine, 0, std::memory_order_release, std::memory_order_relaxed)) {
        const int error = futex_unlock_inheriting(word.value);
        QDUINO_EXPECT(error == 0);  // else: not held by the caller
    }
    if (VcpuThread* self = VcpuThread::current()) self->end_hold();
}

}  // namespace qduino::board::linux
