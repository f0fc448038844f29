// A lock between loops, over the port: for buses and serial ports that several loops share, and, as
// Mutex, for the sketch.
//
// It is the board's lock (board/board.h) and not the system's. In the simulator every loop is a
// fiber of one thread, so a blocking mutex would stop the very fiber that is to release it. On
// Linux a plain mutex would let a loop of middle rank hold up a high one for as long as it likes:
// it runs instead of the low one that has the lock. So a waiter lends its rank:
//
//   loop high        lock ░░░░░░████                 ░ waits for the rest of low's critical section
//   loop mid     ████                ██████████        only, whatever mid wants
//   loop low  lock██      ██unlock             ██    ranks as high from high's lock() on
//
// Without contention it is one compare-and-swap each way.
#pragma once

#include <atomic>
#include <cstdint>

#include "board/types.h"
#include "runtime/lock_declaration.h"

namespace qduino::arduino {

/// Recursive: a loop may take a lock again that it holds. Taken and released by the same loop (or
/// both in setup()).
class Lock {
  public:
    void lock();
    /// False when another loop holds it.
    [[nodiscard]] bool try_lock();
    /// Contract: held by the caller.
    void unlock();

  private:
    board::LockWord word_;
    std::atomic<std::uint32_t> owner_{0};  // 0: free; else the holder's VcpuId + 1
    std::uint32_t depth_ = 0;              // the holder's
};

/// `loop` holds `lock` for at most `length` of its CPU time, once in a release. Setup-time.
void declare_section(runtime::LockDeclaration& lock, board::VcpuId loop, Nanoseconds length);

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
