// The kernel threads that do the bottom halves of an I/O VCPU, kept to its budget by the warden:
// threaded interrupts, threaded NAPI.
//
//   irq/36-eth0-rx ─┐ CPU time           ┌─ spent: SCHED_OTHER for all of them
//   irq/37-eth0-tx ─┼───────► IoWatch ───┤
//   io 34 ──────────┘ (its own handlers) └─ replenished: SCHED_FIFO, the VCPU's rank
//
// A kernel thread can be neither stopped nor asked to keep itself, so its priority is all that can
// be taken from it: it then has the time that no loop wants. While it waits, its device waits with
// it: the kernel masks the interrupt of such a thread, or polls no packets.
//
// What this cannot keep: the top halves, and what the kernel does in no thread of the device's own
// (soft interrupts, on the way out of an interrupt or in ksoftirqd; work queues). Admission counts
// what was measured of those (interference.h).
//
// The board has recorded what each thread had (host_settings.h) before it ranked it, so that is
// what it has again at the end, or after any death. No heap: in the warden's process.
#pragma once

#include "base/fixed_vector.h"
#include "board/linux/kernel/held_thread.h"
#include "board/linux/kernel/thread_times.h"
#include "board/linux/loop/warden_pages.h"
#include "sched/io_watch.h"

namespace qduino::board::linux {

class WatchedBottomHalf {
  public:
    /// Watches the I/O VCPU `ward` of process `sketch`; its kernel threads get their rank. False:
    /// it has none, or its budget is not enforced. `orders` and `findings` outlive it.
    [[nodiscard]] bool open(pid_t sketch, const Ward& ward, const WardenOrders& orders,
                            WardFindings& findings);
    [[nodiscard]] Instant next_look() const { return watch_.next_look(); }
    void look(Instant now);
    /// Thread `tid` is one of them.
    [[nodiscard]] bool has(pid_t tid) const;

  private:
    struct Member {
        ThreadPlace place;
        ThreadTimesFile times;
        Nanoseconds cpu{};
        bool kernels = false;  // false: the I/O VCPU's own thread, which keeps itself
    };
    bool add(pid_t process, const ThreadPlace& place, bool kernels);
    Nanoseconds cpu();
    void set_rank(bool has_it);

    FixedVector<Member, kKernelThreadsMax + 1> members_;
    sched::IoWatch watch_;
    const ParametersMail* changes_ = nullptr;
    std::uint32_t changes_seen_ = 0;
    WardFindings* findings_ = nullptr;
    bool held_ = false;
};

}  // namespace qduino::board::linux
