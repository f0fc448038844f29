#include "arduino/libraries/timers/periodic_call.h"

#include <algorithm>

#include "board/board.h"

namespace qduino::arduino {

void PeriodicCall::ask(Wish wish) {
    const LockGuard held{asking_};
    wish.order = ++orders_;
    wishes_.write(wish);
}

void PeriodicCall::start(Nanoseconds period, TimedCall function, Nanoseconds delay, std::int64_t calls) {
    const Instant first = board::current().now() + delay;
    calls_left_.store(calls, std::memory_order_relaxed);
    ask({.order = 0, .period = period, .function = function, .first = first, .calls = calls});
}

void PeriodicCall::stop() { ask({}); }

void PeriodicCall::serve() {
    board::Board& board = board::current();
    const Instant end = board.now() + kTimerPeriod;
    while (!board.stop_requested() && board.now() < end) {
        const Wish wish = wishes_.read();
        if (wish.order != served_) {
            served_ = wish.order;
            due_ = wish.first;
            calls_left_.store(wish.calls, std::memory_order_relaxed);
        }
        const Instant now = board.now();
        const std::int64_t left = calls_left();
        if (wish.period.count() == 0 || left == 0) return board.sleep_until(end);
        if (now >= due_) {
            due_ += wish.period * (1 + (now - due_) / wish.period);
            if (left != kNoEnd) calls_left_.store(left - 1, std::memory_order_relaxed);
            wish.function();
            continue;
        }
        board.sleep_until(std::min(due_, end));
    }
}

}  // namespace qduino::arduino
