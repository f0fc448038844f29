// A lock between loops, over the port: for buses and serial ports that several loops share.
//
// It is not a mutex of the system, for two reasons. In the simulator every loop is a fiber of one thread, so a blocking
// mutex would stop the very fiber that is to release it. And a spin lock would hang two SCHED_FIFO loops that share a
// core: the higher one spins for ever above the lower one that holds it. So a waiter *sleeps* through the port, which
// consumes no budget, lets any other loop run, and advances virtual time:
//
//   loop A  ──lock────────unlock────                       held
//   loop B       ──try─sleep─try─sleep─try══════           waits in steps of kLockRetryStep
//
// Uncontended: one atomic exchange. Contended: a waiter is late by at most one step beyond the release. Inversion is
// bounded because every loop that may run between has a budget; a bus is held for one transaction only.
#pragma once

#include <atomic>
#include <cstdint>

#include "base/time.h"

namespace qduino::arduino {

inline constexpr Nanoseconds kLockRetryStep{20'000};

/// Recursive: a loop may take again what it holds. Taken and released by the same loop (or both in setup()).
class Lock {
  public:
    void lock();
    /// False when another loop holds it.
    [[nodiscard]] bool try_lock();
    /// Contract: held by the caller.
    void unlock();

  private:
    std::atomic<std::uint32_t> owner_{0};  // 0: free; else the holder's VcpuId + 1
    std::uint32_t depth_ = 0;              // the holder's
};

/// Holds a Lock for a scope.
class LockGuard {
  public:
    explicit LockGuard(Lock& lock) : lock_(lock) { lock_.lock(); }
    ~LockGuard() { lock_.unlock(); }
    LockGuard(const LockGuard&) = delete;
    LockGuard& operator=(const LockGuard&) = delete;

  private:
    Lock& lock_;
};

}  // namespace qduino::arduino
