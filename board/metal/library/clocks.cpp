// The C library's clocks and waits. musl would look for the clock in a page that a system gives to
// each of its programs (the vDSO), and there is none: it would follow a null pointer. So clock(),
// time(), std::chrono's clocks, nanosleep() and std::this_thread::sleep_for() all come here.
//
//   CLOCK_MONOTONIC and its kin    since the computer began (computer/clock.h)
//   CLOCK_REALTIME                 the date, if a clock told it when the computer began; else 1970
//   CLOCK_THREAD_CPUTIME_ID        what the calling loop was charged; in setup() nothing
//   a wait                         the loop sleeps, and others run
//
// clock_gettime(2), clock_nanosleep(2); the numbers are Linux's.
#include <chrono>  // and with it timespec
#include <cstdint>

#include "board/board.h"
#include "board/metal/computer/clock.h"

namespace qduino::board::metal {
namespace {

constexpr int kRealTime = 0, kProcessCpuTime = 2, kThreadCpuTime = 3, kRealTimeCoarse = 5, kLastClock = 7;
constexpr int kAbsolute = 1;  // TIMER_ABSTIME
constexpr int kInvalid = 22;  // EINVAL
constexpr std::int64_t kSecond = 1'000'000'000;

bool counts_cpu_time(int clock) { return clock == kProcessCpuTime || clock == kThreadCpuTime; }

/// What a clock that counts no CPU time says at instant 0.
Nanoseconds begin_of(int clock) {
    const bool tells_date = clock == kRealTime || clock == kRealTimeCoarse;
    return tells_date ? computer_clock.date_of_instant_0() : Nanoseconds{0};
}

int tell_time(int clock, timespec* time) {
    if (clock < 0 || clock > kLastClock) return -1;
    const Nanoseconds since =
        counts_cpu_time(clock) ? current().cpu_time() : computer_clock.now() - kEpoch + begin_of(clock);
    *time = {since.count() / kSecond, since.count() % kSecond};
    return 0;
}

int wait_for(int clock, int flags, const timespec* time) {
    if (clock < 0 || clock > kLastClock || counts_cpu_time(clock) || time->tv_sec < 0 ||
        time->tv_sec > INT64_MAX / kSecond / 2 || time->tv_nsec < 0 || time->tv_nsec >= kSecond)
        return kInvalid;
    const Nanoseconds length{time->tv_sec * kSecond + time->tv_nsec};
    current().sleep_until(flags & kAbsolute ? kEpoch + length - begin_of(clock)
                                            : computer_clock.now() + length);
    return 0;
}

}  // namespace
}  // namespace qduino::board::metal

// musl calls the second of each pair.
extern "C" {
int clock_gettime(clockid_t clock, timespec* time) { return qduino::board::metal::tell_time(clock, time); }
int __clock_gettime(clockid_t clock, timespec* time) { return qduino::board::metal::tell_time(clock, time); }
int clock_nanosleep(clockid_t clock, int flags, const timespec* time, timespec*) {
    return qduino::board::metal::wait_for(clock, flags, time);
}
int __clock_nanosleep(clockid_t clock, int flags, const timespec* time, timespec*) {
    return qduino::board::metal::wait_for(clock, flags, time);
}
}
