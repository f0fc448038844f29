// A function that is called again and again, as a timer's interrupt calls it on the AVR:
// TimerOne.h, MsTimer2.h and TimerInterrupt.h. It runs on a loop of its own, 500 µs in every 5 ms,
// which is admitted and accounted for like every other, and which only a sketch with such a timer
// has.
//
//   call    ▌       ▌       ▌       ▌   at absolute instants: a late one does not shift the next,
//   loop    █       █       ██      █      and missed ones are left out
#pragma once

#include <atomic>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "arduino/core/lock.h"
#include "arduino/core/loops.h"
#include "base/time.h"
#include "channel/four_slot.h"

namespace qduino::arduino {

/// A function, and what it is called with.
struct TimedCall {
    TimedCall() = default;
    explicit TimedCall(void (*function)()) : function_(function), invoke_(&invoke_plain) {}
    /// `argument` is copied: a number or a pointer.
    template <typename T>
    TimedCall(void (*function)(T), T argument)
        : function_(reinterpret_cast<void (*)()>(function)), invoke_(&invoke_with<T>) {
        static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= sizeof argument_);
        std::memcpy(&argument_, &argument, sizeof argument);
    }
    explicit operator bool() const { return function_ != nullptr; }
    void operator()() const { invoke_(*this); }

  private:
    static void invoke_plain(const TimedCall& call) { call.function_(); }
    template <typename T>
    static void invoke_with(const TimedCall& call) {
        T argument;
        std::memcpy(&argument, &call.argument_, sizeof argument);
        reinterpret_cast<void (*)(T)>(call.function_)(argument);
    }

    void (*function_)() = nullptr;
    void (*invoke_)(const TimedCall&) = nullptr;
    std::uint64_t argument_ = 0;
};

class PeriodicCall {
  public:
    static constexpr std::int64_t kNoEnd = -1;

    /// Calls `function` every `period`, first in `delay` from now: `calls` times, or until it is
    /// stopped. By any loop, or in setup().
    void start(Nanoseconds period, TimedCall function, Nanoseconds delay, std::int64_t calls = kNoEnd);
    void start(Nanoseconds period, void (*function)()) { start(period, TimedCall{function}, period); }
    void stop();
    /// Calls that are still to come, or kNoEnd.
    [[nodiscard]] std::int64_t calls_left() const { return calls_left_.load(std::memory_order_relaxed); }

    /// The loop's body: calls what is due, for a period. It waits for no period of its own, and has
    /// none to keep: its budget bounds it.
    void serve();

  private:
    struct Wish {
        std::uint64_t order = 0;
        Nanoseconds period{};  // zero: nothing is called
        TimedCall function{};
        Instant first{};
        std::int64_t calls = kNoEnd;
    };
    void ask(Wish wish);

    channel::FourSlot<Wish> wishes_;
    // The four-slot has one writer; several loops may ask.
    Lock asking_{"a timer", runtime::Unsaid::brief};
    std::uint64_t orders_ = 0;
    std::uint64_t served_ = 0;  // of the wish that `due_` belongs to
    Instant due_{};
    std::atomic<std::int64_t> calls_left_{kNoEnd};
};

/// The budget and the period of each timer's loop.
inline constexpr Nanoseconds kTimerBudget{500'000};
inline constexpr Nanoseconds kTimerPeriod{5'000'000};

/// Enters the loop of a timer into the sketch's table. Static objects only.
struct TimerRegistration : LoopRegistration {
    TimerRegistration(int id, void (*body)(), const char* name)
        : LoopRegistration(id, kTimerBudget, kTimerPeriod, runtime::kAnyCore, Nanoseconds{0}, 0, body, name,
                           0) {}
};

}  // namespace qduino::arduino
