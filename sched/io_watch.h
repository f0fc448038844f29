// A bottom half's budget, kept from outside: for a kernel thread, which cannot keep itself.
//
// A kernel thread that does the bottom half of an interrupt has no timer of ours. Somebody else
// looks at its CPU time now and then, charges that to a PIBS server (pibs.h), and takes the
// thread's priority while the server has nothing left:
//
//   look      look      look         replenishment
//    │ used    │ used    │ too much        │
//    ├─────────┼─────────┤ held            ├─► has its priority again
//    ▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒  · · · · · · · · ▒▒▒▒
//    eligible ───────────── used/U ───────►│
//
// - A look comes too late to stop the thread at its budget. What it used beyond is charged forward:
//   it waits the longer. So the share is kept, and a stretch may be longer than a budget by the
//   time between two looks.
// - A look in which it used nothing ends its service.
// - A thread that is held is an ordinary one, and runs where nobody else wants the core. That time
//   is nobody's, and is not charged.
//
// With L the longest time between two looks, and T the client's period, it takes no more from
// others than U·t + 2·(U·T + L) in any t. Pure: no clock, no system.
#pragma once

#include <cstdint>

#include "base/time.h"
#include "sched/pibs.h"

namespace qduino::sched {

class IoWatch {
  public:
    enum class Verdict : std::uint8_t {
        run,   ///< it may have its priority
        hold,  ///< it may not, until a look says otherwise
    };

    IoWatch() = default;  ///< for arrays only: assign before use
    /// The watch of an I/O VCPU that works for a client of `client_period` (0: its own period),
    /// whose threads have used `cpu` at `now`. `look_every`: how soon a look can follow another.
    IoWatch(VcpuParameters io, Nanoseconds client_period, Nanoseconds look_every, Instant now,
            Nanoseconds cpu);

    /// They have used `cpu` at `now`. An instant before the last one is taken as the last one.
    Verdict look(Instant now, Nanoseconds cpu);
    /// After a look that said `hold`, when it is held: what it used on the way there is charged.
    void held(Instant now, Nanoseconds cpu);
    /// It has this budget and period from `now` on.
    void change(Instant now, Nanoseconds cpu, VcpuParameters io);
    /// Nothing can be found out before.
    [[nodiscard]] Instant next_look() const;

    /// The CPU time that was charged to it.
    [[nodiscard]] Nanoseconds used() const { return server_.consumed(); }
    [[nodiscard]] Nanoseconds watched() const { return looked_at_ - started_at_; }
    /// How often it was to be held.
    [[nodiscard]] std::uint32_t holds() const { return holds_; }

  private:
    void charge(Instant now, Nanoseconds cpu);

    Pibs server_;
    Nanoseconds look_every_{};
    Instant started_at_{};
    Instant looked_at_{};
    Nanoseconds cpu_{};
    std::uint32_t holds_ = 0;
    bool held_ = false;
};

}  // namespace qduino::sched
