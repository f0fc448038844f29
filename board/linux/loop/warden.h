// The warden: a process beside the sketch that keeps each loop to its budget when the loop does not
// do so itself.
//
// A loop keeps itself to its budget in the handler of a signal (budget_keeper.h). That costs little
// and is exact, and a sketch can end it with one line: it blocks the signal, replaces the handler,
// deletes the timer. So somebody looks at the loop's CPU time from outside, without its help.
//
//   sketch ──clone, before the loops──► warden    at a priority above every loop; sleeps
//     │ loop 1 ──blocks its signals, spins──►        │
//     │        ◄── stopped (held_thread.h) ──────────┤ it took more than a server can give
//     │        ◄── goes on at its priority ──────────┘ it has earned a budget (budget_watch.h)
//
// Why a process: a thread of the sketch shares its memory with those that it watches, and the
// kernel lets no thread stop another one of its own process. Why not the supervisor: a sketch must
// not need one, and the warden needs no privilege that the sketch has not. It is a copy of the
// sketch and not a program of its own, so that there is no second program to be found.
//
// It ends with the sketch. Loops cannot reach it: confinement.h has the ways that are refused. What
// setup() started can, and so can another program. So the warden beats: at each look it writes the
// time into pages that nobody else can write (warden_pages.h), and into the pins file. The beat is
// judged by its value. The supervisor that misses it kills the sketch, with safe pins, and says why
// (apps/supervisor/hang.h). Without a supervisor the board takes the rank of the loops, and asks
// them to end.
//
// Cost, measured on a 2-core VM (kernel 6.18): 30 to 40 µs for a look, every 4 ms at most, and 0.4
// % of a core for two loops. Threads of setup()'s cost some 10 µs each, every 8 ms. Admission
// counts it above every loop (overheads.h).
#pragma once

#include <sys/types.h>

#include <span>

#include "base/fixed_string.h"
#include "base/result.h"
#include "board/linux/loop/warden_pages.h"
#include "board/linux/loop/warden_process.h"
#include "posix/mapping.h"

namespace qduino::board::linux {

class Warden {
  public:
    Warden() = default;
    ~Warden() { dismiss(); }
    Warden(const Warden&) = delete;
    Warden& operator=(const Warden&) = delete;

    /// Starts the process. Before there are loops, and before memory is locked: from then on the
    /// two share no page that the sketch writes. The calling thread lives as long as the warden.
    /// Error: the system's.
    Result<void> hire(WardenTask task);
    /// Gives it its wards, which have not begun yet, and kernel threads that work on the budgets of
    /// some of them; `witness` is another thread of the board's. `grows`: a ward may make threads.
    /// Waits until it watches. Error: unavailable.
    Result<void> watch(std::span<const Ward> wards, std::span<const KernelThread> kernel_threads,
                       pid_t witness, bool grows = false);
    /// I/O VCPU `io` has another budget and period. From one thread at a time; no system call. The
    /// warden takes it up at its next look at that ward.
    void change(VcpuId io, sched::VcpuParameters parameters);
    /// Ends it. All wards have ended.
    void dismiss();

    /// 0: there is none.
    [[nodiscard]] pid_t pid() const { return pid_; }
    /// It was hired and watches.
    [[nodiscard]] bool watches() const;
    /// Why it does not, or did not all along, though it had begun: for a report. Empty: it did.
    [[nodiscard]] FixedString<160> lapse() const;
    /// It had begun to watch, and is dead, or has not looked for so long that it will not again.
    [[nodiscard]] bool is_lost() const;
    /// Null: none was hired. Read-only.
    [[nodiscard]] const WardenFindings* findings() const {
        return pages_of_findings_.valid() ? pages_of_findings_.as<const WardenFindings>() : nullptr;
    }

  private:
    void ring() const;
    [[nodiscard]] bool has_ended() const;
    [[nodiscard]] Nanoseconds silence() const;

    posix::Mapping pages_of_orders_;
    posix::Mapping pages_of_findings_;
    pid_t pid_ = 0;
    mutable bool ended_ = false;  // reaped when that is noticed
    bool begun_ = false;          // it has watched
    Nanoseconds patience_{};      // with its silence
};

}  // namespace qduino::board::linux
