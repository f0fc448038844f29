#include "arduino/libraries/FreeRTOS/freertos/objects.h"

#include <cstring>

#include "board/board.h"

namespace qduino::arduino::freertos {

// ---- queues -------------------------------------------------------------------------------------

Queue::Queue(std::size_t length, std::size_t item_bytes)
    : length_(length), item_bytes_(item_bytes), items_(length * item_bytes) {}

bool Queue::send(const void* item, Ticks ticks, bool to_front) {
    return wait_until(ticks, [&] { return try_send(item, to_front); });
}

bool Queue::try_send(const void* item, bool to_front) {
    const LockGuard held(lock_);
    const std::size_t size = size_.load();
    if (size == length_) return false;
    if (to_front) first_ = (first_ + length_ - 1) % length_;
    if (item_bytes_ > 0) std::memcpy(place(to_front ? first_ : first_ + size), item, item_bytes_);
    size_.store(size + 1);
    return true;
}

void Queue::overwrite(const void* item) {
    const LockGuard held(lock_);
    first_ = 0;
    if (item_bytes_ > 0) std::memcpy(place(0), item, item_bytes_);
    size_.store(1);
}

bool Queue::receive(void* item, Ticks ticks, bool take) {
    return wait_until(ticks, [&] { return try_receive(item, take); });
}

bool Queue::try_receive(void* item, bool take) {
    const LockGuard held(lock_);
    const std::size_t size = size_.load();
    if (size == 0) return false;
    if (item_bytes_ > 0) std::memcpy(item, place(first_), item_bytes_);
    if (!take) return true;
    first_ = (first_ + 1) % length_;
    size_.store(size - 1);
    return true;
}

void Queue::reset() {
    const LockGuard held(lock_);
    first_ = 0;
    size_.store(0);
}

// ---- semaphores ---------------------------------------------------------------------------------

bool Semaphore::take(Ticks ticks) {
    if (kind_ != Kind::counting) return take_mutex(ticks);
    return wait_until(ticks, [this] { return try_count_down(); });
}

bool Semaphore::try_count_down() {
    for (std::uint32_t seen = count_.load(); seen > 0;) {
        if (count_.compare_exchange_weak(seen, seen - 1)) return true;
    }
    return false;
}

bool Semaphore::take_mutex(Ticks ticks) {
    const board::VcpuId self = board::current().current_vcpu();
    if (holder_.load() == self && depth_ > 0) {
        // It would wait for itself; what is recursive counts.
        if (kind_ != Kind::recursive) return wait_until(ticks, [] { return false; });
        ++depth_;
        return true;
    }
    if (ticks == kForeverTicks)
        lock_.lock();
    else if (!wait_until(ticks, [this] { return lock_.try_lock(); }))
        return false;
    holder_.store(self);
    depth_ = 1;
    count_.store(0);
    return true;
}

bool Semaphore::give() {
    if (kind_ == Kind::counting) {
        for (std::uint32_t seen = count_.load(); seen < most_;) {
            if (count_.compare_exchange_weak(seen, seen + 1)) return true;
        }
        return false;
    }
    if (depth_ == 0 || holder_.load() != board::current().current_vcpu()) return false;
    if (--depth_ > 0) return true;
    holder_.store(board::kNoVcpu);
    count_.store(1);
    lock_.unlock();
    return true;
}

// ---- groups of events ---------------------------------------------------------------------------

std::uint32_t EventGroup::wait(std::uint32_t bits, bool clear_after, bool all, Ticks ticks) {
    std::uint32_t seen = 0;
    const bool came = wait_until(ticks, [&] {
        seen = bits_.load();
        return all ? (seen & bits) == bits : (seen & bits) != 0;
    });
    if (came && clear_after) clear(bits);
    return seen;
}

// ---- timers -------------------------------------------------------------------------------------

namespace {

constexpr std::size_t kTimers = 16;
FixedVector<Timer*, kTimers> timers;  // none is ever destroyed
bool served = false;

void serve_timers(void*) {
    for (Ticks next = tick_count();;) {
        for (Timer* const timer : timers) timer->look(tick_count());
        sleep_until_tick(++next);
        if (static_cast<std::int32_t>(tick_count() - next) > 1) next = tick_count();
    }
}

}  // namespace

Timer* make_timer(const char* name, Ticks period, bool again, void* id, Timer::Function function) {
    constexpr std::uint8_t kHighest = 3;
    if (timers.size() == kTimers || period == 0 || !function) return nullptr;
    if (!served) served = make_task(&serve_timers, "Tmr Svc", 0, nullptr, kHighest) != nullptr;
    if (!served) return nullptr;
    timers.push_back(new Timer(name, period, again, id, function));
    return timers.back();
}

void Timer::start_at(Ticks now) {
    due_.store(now + period_.load());
    runs_.store(true);
}

void Timer::look(Ticks now) {
    if (!runs_.load() || static_cast<std::int32_t>(due_.load() - now) > 0) return;
    if (again_)
        due_.fetch_add(period_.load());
    else
        runs_.store(false);
    function_(this);
}

}  // namespace qduino::arduino::freertos
