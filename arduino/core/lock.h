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
#include <source_location>

#include "arduino/core/loops.h"
#include "board/types.h"
#include "runtime/lock_declaration.h"

namespace qduino::arduino {

/// Recursive: a loop may take a lock again that it holds. Taken and released by the same loop (or
/// both in setup()). What admission knows of it is its declaration (runtime/lock_declaration.h).
class Lock {
  public:
    using Unsaid = runtime::Unsaid;
    /// `name`: as the sketch calls it; it outlives the lock.
    explicit Lock(const char* name, Unsaid unsaid) : declaration_(name, unsaid) {}
    /// The lock of a bus that is held for `bytes` at a time.
    Lock(const char* name, board::DeviceClass device, std::size_t bytes)
        : declaration_(name, device, bytes) {}

    void lock();
    /// False when another loop holds it.
    [[nodiscard]] bool try_lock();
    /// Contract: held by the caller.
    void unlock();
    [[nodiscard]] runtime::LockDeclaration& declaration() { return declaration_; }

  private:
    void begin_to_hold(std::uint32_t self);

    board::LockWord word_;
    std::atomic<std::uint32_t> owner_{0};  // 0: free; else the holder's VcpuId + 1
    std::uint32_t depth_ = 0;              // the holder's
    Nanoseconds cpu_at_lock_{};            // likewise, where holds are measured
    runtime::LockDeclaration declaration_;
};

/// `loop` holds `lock` for at most `length` of its CPU time, once in a release. Setup-time.
void declare_section(Lock& lock, int loop, Nanoseconds length, const std::source_location& where);
/// The handler of an interrupt does, once in each run of it. Setup-time.
void declare_section(Lock& lock, void (*handler)(), Nanoseconds length, const std::source_location& where);

/// A bus with this lock is begun. Setup-time.
void declare_use(Lock& lock);

/// heldBy() of whatever has a `lock_`.
template <typename Holder>
class SaysWhoHolds {
  public:
    /// Setup-time. `length`: CPU time, a std::chrono duration or milliseconds; once in a release.
    /// A loop that is not named must not take it, nor one of no length.
    template <typename Duration>
    void heldBy(int loop, Duration length, std::source_location where = std::source_location::current()) {
        declare_section(static_cast<Holder*>(this)->lock_, loop, to_duration(TimeUnit::ms, length), where);
    }
    /// The same of the handler of an interrupt, once in each run of it. It must be attached.
    template <typename Duration>
    void heldBy(void (*handler)(), Duration length,
                std::source_location where = std::source_location::current()) {
        declare_section(static_cast<Holder*>(this)->lock_, handler, to_duration(TimeUnit::ms, length), where);
    }
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
