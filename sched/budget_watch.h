// What a VCPU may use at most, as somebody sees it who is told its CPU time and nothing else.
//
// A thread keeps itself to its budget (budget_account.h), and a thread can stop doing so: it blocks
// the timer's signal, and the account hears of nothing any more. So somebody outside of the thread
// looks at its CPU time now and then, and holds it when it took more than a server can give.
//
//   level   2C ┬──╮    ╭──╮                                full: a loop that sleeps
//            C ┤  ╰─╮╭─╯  ╰╮                 ╭╮            resumed
//            0 ┤    ╰╯     ╰╮    held       ╭╯╰╮  held     from now on held as soon as it is empty
//     patience ─┤            ╰╮╭─────────────╯  ╰╮╭──
//                            ╰╯ it took more: an escape
//
// The level rises by (C + w)/T + 0.2 % of the time that passes, and falls by the CPU time used. w
// is the one wait in each period that admission counts beside the budget; at most T/80 or 10 µs.
//
// A server gives no more than C·(1 + ⌈t/T⌉) <= 2C + C·t/T in any t: a chunk that was preempted is
// given late, and the next one at once (back to back; sporadic_server.h). The patience beyond that:
// - C, by which a holder of a lock may overrun once, and 5 ms (or C) for one that does it again;
// - a tick: what the kernel tells of a running thread is so old;
// - what the level would have risen beyond 2C while others kept the thread from running: it catches
//   up afterwards.
// What a host or an interrupt takes while the thread runs looks like its own use, and comes at
// once: 100 ms of a budget of 1 ms. A thread that keeps itself sleeps then until it has paid. So
// one that falls below the patience is held only if it goes on: if it has sunk further by the grace
// at a later look.
//
//   level   C ┤╮ a host's pause                    ╭──       an escape: it goes on
//    patience ┤│                          ╭────────╯          ╲
//             ┤╰── it sleeps until it has paid                 ╲ grace: held
//
// So a thread that keeps to its budget is never held. One that does not gets no more than
//
//   C + ((C + w)/T + 0.2 %)·t + patience + grace + the time between two looks
//
// in the first t, for an overrun is paid back, and whoever was held once has no grace until it has
// been full again. Pure: no clock, no system.
#pragma once

#include <cstdint>

#include "base/time.h"
#include "sched/vcpu.h"

namespace qduino::sched {

/// What the kernel tells of a thread.
struct ThreadTimes {
    Nanoseconds cpu{};      ///< that it has used, ever
    Nanoseconds delayed{};  ///< that it could run and did not, ever; told when it runs again
};

class BudgetWatch {
  public:
    /// The longest time that the CPU time of a running thread may be old: the tick of the kernel
    /// (4 ms at 250 Hz). So no thread is looked at more often, or let go for less.
    static constexpr Nanoseconds kTick = 4ms;
    /// A part of the time that passes, beside the VCPU's own share: what two clocks and a wait may
    /// differ by.
    static constexpr int kMarginDivisor = 500;
    /// What one that pays by itself may still use: its keeper's way through its sleeps.
    static constexpr Nanoseconds kGrace = 2ms;
    /// A wait may be so long in any period.
    static constexpr Nanoseconds kWaitInAnyPeriod = 10us;

    enum class Verdict : std::uint8_t {
        run,   ///< it may run
        hold,  ///< it is to be held, until a look says otherwise
    };

    BudgetWatch() = default;  ///< for arrays only: assign before use
    /// The watch of a VCPU that begins at `now` with `times`. `wait`: see the head of this file.
    BudgetWatch(VcpuParameters vcpu, Nanoseconds wait, Instant now, ThreadTimes times);

    /// These are its times at `now`. An instant before the last one is taken as the last one.
    Verdict look(Instant now, ThreadTimes times);
    /// It has this budget and period from `now` on, when its times are these. It owes no more than
    /// it may by the new ones.
    void change(Instant now, ThreadTimes times, VcpuParameters vcpu);
    /// Nothing can be found out before.
    [[nodiscard]] Instant next_look() const { return next_look_; }

    [[nodiscard]] Nanoseconds used() const { return times_.cpu - cpu_at_start_; }
    [[nodiscard]] Nanoseconds watched() const { return looked_at_ - started_at_; }
    /// How often it was to be held.
    [[nodiscard]] std::uint32_t holds() const { return holds_; }

  private:
    void settle(Instant now, ThreadTimes times);
    [[nodiscard]] bool goes_on();
    [[nodiscard]] Nanoseconds patience() const;
    [[nodiscard]] Nanoseconds earned_in(Nanoseconds time) const;
    [[nodiscard]] Nanoseconds time_to_earn(Nanoseconds amount) const;

    VcpuParameters vcpu_;
    Nanoseconds wait_asked_{};
    Nanoseconds wait_{};
    Instant started_at_{};
    Instant looked_at_{};
    Instant next_look_{};
    Nanoseconds cpu_at_start_{};
    ThreadTimes times_;
    Nanoseconds level_{};
    Nanoseconds cut_{};      // what it was too full for, since it last ran
    Nanoseconds backlog_{};  // that much of it was due to others, and may be caught up
    std::uint32_t holds_ = 0;
    Nanoseconds fell_to_{};  // the level when it fell below the patience
    bool fallen_ = false;    // and is still there, and runs
    bool held_ = false;
    bool escaped_ = false;  // until it has been full once more
};

}  // namespace qduino::sched
