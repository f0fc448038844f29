#include "arduino/core/lock.h"

#include "base/contract.h"
#include "board/board.h"

namespace qduino::arduino {
namespace {

std::uint32_t caller() { return std::uint32_t{board::current().current_vcpu()} + 1; }

}  // namespace

bool Lock::try_lock() {
    if (owner_.load(std::memory_order_relaxed) != caller()) {
        if (!board::current().try_lock(word_)) return false;
        owner_.store(caller(), std::memory_order_relaxed);
    }
    ++depth_;
    return true;
}

void Lock::lock() {
    if (owner_.load(std::memory_order_relaxed) != caller()) {
        board::current().lock(word_);
        owner_.store(caller(), std::memory_order_relaxed);
    }
    ++depth_;
}

void Lock::unlock() {
    QDUINO_EXPECT(owner_.load(std::memory_order_relaxed) == caller());
    if (--depth_ > 0) return;
    owner_.store(0, std::memory_order_relaxed);
    board::current().unlock(word_);
}

}  // namespace qduino::arduino
