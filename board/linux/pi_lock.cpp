#include "board/linux/pi_lock.h"

#include <sys/syscall.h>
#include <unistd.h>

#include "base/contract.h"
#include "board/linux/announced_wait.h"
#include "board/linux/cycle_clock.h"
#include "board/linux/futex.h"
#include "board/linux/vcpu_thread.h"

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

bool try_to_take_lock(LockWord& word) {
    VcpuThread* self = VcpuThread::current();
    if (self) self->begin_hold();
    const bool taken = take(word);
    if (self && !taken) self->end_hold();
    return taken;
}

void take_lock(LockWord& word) {
    if (VcpuThread* self = VcpuThread::current()) self->begin_hold();
    if (take(word)) return;
    const AnnouncedWait wait;
    const int error = futex_lock_inheriting(word.value);
    while (error == ENOSYS && !take(word)) block_until(monotonic_now() + kRetry);
    // EDEADLK: held by the caller, or a cycle of waits. ESRCH: by a thread that has ended.
    QDUINO_EXPECT(error == 0 || error == ENOSYS);
}

void give_lock(LockWord& word) {
    std::uint32_t mine = own_value();
    if (!word.value.compare_exchange_strong(mine, 0, std::memory_order_release, std::memory_order_relaxed)) {
        QDUINO_EXPECT(futex_unlock_inheriting(word.value) == 0);  // else: not held by the caller
    }
    if (VcpuThread* self = VcpuThread::current()) self->end_hold();
}

}  // namespace qduino::board::linux
