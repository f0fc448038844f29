#include "arduino/core/lock.h"

#include "base/contract.h"
#include "runtime/port.h"

namespace qduino::arduino {

bool Lock::try_lock() {
    const std::uint32_t self = std::uint32_t{port::current_vcpu()} + 1;
    std::uint32_t free = 0;
    if (owner_.load(std::memory_order_relaxed) != self &&
        !owner_.compare_exchange_strong(free, self, std::memory_order_acquire, std::memory_order_relaxed)) {
        return false;
    }
    ++depth_;
    return true;
}

void Lock::lock() {
    while (!try_lock()) port::sleep_until(port::now() + kLockRetryStep);
}

void Lock::unlock() {
    QDUINO_EXPECT(owner_.load(std::memory_order_relaxed) == std::uint32_t{port::current_vcpu()} + 1);
    if (--depth_ == 0) owner_.store(0, std::memory_order_release);
}

}  // namespace qduino::arduino
