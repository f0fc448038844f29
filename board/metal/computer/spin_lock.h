// A lock between cores, for a few instructions: the one thing that a core waits for on another one.
// Its holder has its interrupts off, so it is never interrupted while others spin.
#pragma once

#include <atomic>

#include "board/metal/computer/instructions.h"

namespace qduino::board::metal {

class SpinLock {
  public:
    void lock() {
        while (taken_.exchange(true, std::memory_order_acquire)) spin_hint();
    }
    void unlock() { taken_.store(false, std::memory_order_release); }

  private:
    std::atomic<bool> taken_{false};
};

/// Holds a SpinLock, with interrupts off, for a scope. Not twice on one core.
class SpinGuard {
  public:
    explicit SpinGuard(SpinLock& lock) : lock_(lock) { lock_.lock(); }
    ~SpinGuard() { lock_.unlock(); }
    SpinGuard(const SpinGuard&) = delete;
    SpinGuard& operator=(const SpinGuard&) = delete;

  private:
    InterruptsOff off_;  // first: on before the lock is taken, off after it is given back
    SpinLock& lock_;
};

}  // namespace qduino::board::metal
