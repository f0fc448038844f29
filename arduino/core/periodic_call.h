// A function that is called again and again, as a timer's interrupt calls it on the AVR: TimerOne.h
// and MsTimer2.h. It runs on a loop of its own, 500 µs in every 5 ms, which is admitted and
// accounted for like every other, and which only a sketch with such a timer has.
//
//   call    ▌       ▌       ▌       ▌   at absolute instants: a late one does not shift the next,
//   loop    █       █       ██      █      and missed ones are left out
#pragma once

#include "arduino/core/lock.h"
#include "arduino/core/loops.h"
#include "base/time.h"
#include "channel/four_slot.h"

namespace qduino::arduino {

class PeriodicCall {
  public:
    /// Calls `function` every `period`, first in one period from now. By any loop, or in setup().
    void start(Nanoseconds period, void (*function)());
    void stop();

    /// The loop's body: calls what is due, and returns at the end of its release.
    void serve();

  private:
    struct Wish {
        std::uint64_t order = 0;
        Nanoseconds period{};  // zero: nothing is called
        void (*function)() = nullptr;
        Instant first{};
    };
    void ask(Wish wish);

    channel::FourSlot<Wish> wishes_;
    Lock asking_;  // the four-slot has one writer; several loops may ask
    std::uint64_t orders_ = 0;
    std::uint64_t served_ = 0;  // of the wish that `due_` belongs to
    Instant due_{};
};

/// Of each timer's loop.
inline constexpr Nanoseconds kTimerBudget{500'000};
inline constexpr Nanoseconds kTimerPeriod{5'000'000};

/// Enters the loop of a timer into the sketch's table. Static objects only.
struct TimerRegistration : LoopRegistration {
    TimerRegistration(int id, void (*body)(), const char* name)
        : LoopRegistration(id, kTimerBudget, kTimerPeriod, runtime::kAnyCore, Nanoseconds{0}, body, name, 0) {
    }
};

}  // namespace qduino::arduino
