#include "arduino/core/channels.h"

void Spinlock::lock() {
    constexpr int kSpins = 10;
    constexpr qduino::Nanoseconds kSpin{1'000};
    for (int i = 0; i < kSpins; ++i) {
        if (lock_.try_lock()) return;
        qduino::port::busy_until(qduino::port::now() + kSpin);
    }
    lock_.lock();
}
