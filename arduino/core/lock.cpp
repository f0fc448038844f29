#include "arduino/core/lock.h"

#include "base/contract.h"
#include "board/board.h"

namespace qduino::arduino {
namespace {

std::uint32_t caller() { return std::uint32_t{board::current().current_vcpu()} + 1; }

}  // namespace

bool Lock::try_lock() {
    const std::uint32_t self = caller();
    if (owner_.load(std::memory_order_relaxed) != self) {
        if (!board::current().try_lock(word_)) return false;
        begin_to_hold(self);
    }
    ++depth_;
    return true;
}

void Lock::lock() {
    const std::uint32_t self = caller();
    if (owner_.load(std::memory_order_relaxed) != self) {
        declaration_.taken_by(static_cast<board::VcpuId>(self - 1));
        board::current().lock(word_);
        begin_to_hold(self);
    }
    ++depth_;
}

void Lock::begin_to_hold(std::uint32_t self) {
    owner_.store(self, std::memory_order_relaxed);
    declaration_.taken_by(static_cast<board::VcpuId>(self - 1));
    if (declaration_.measures()) cpu_at_lock_ = board::current().cpu_time();
}

void Lock::unlock() {
    QDUINO_EXPECT(owner_.load(std::memory_order_relaxed) == caller());
    if (--depth_ > 0) return;
    if (declaration_.measures())
        declaration_.held_for(board::current().current_vcpu(), board::current().cpu_time() - cpu_at_lock_);
    owner_.store(0, std::memory_order_relaxed);
    board::current().unlock(word_);
}

}  // namespace qduino::arduino
