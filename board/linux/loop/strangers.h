// Threads and processes of a sketch that are in nobody's budget, as the warden watches them.
//
// They are ordinary tasks, and take what no loop wants. There are two ways out of that:
//
//   a thread makes itself real-time            it is stopped for good. After the second, all of
//                                              them are: somebody makes others in their place
//   a lock with priority inheritance: a loop   what it uses meanwhile is charged to the loop. When
//   waits for it, and the kernel lends the     that has nothing left, the warden stops the loop:
//   loop's priority to the holder              it waits no longer, and so lends nothing
//
// Both show in one number, the effective priority of a thread (field 18 of proc_pid_stat(5): below
// zero for a real-time one). A thread that was lent it has an ordinary policy (field 41).
//
// Loops make no threads (confinement.h). So a sketch has strangers only if setup() or a library
// made some, or a classic loop() may. They are looked at every 8 ms then. Else the warden pays for
// nothing but a look each 200 ms. Child processes are strangers, and theirs, too; one whose parent
// has died is the sketch's child then (PR_SET_CHILD_SUBREAPER, LinuxBoard). New processes are
// looked for every 200 ms. So those that make themselves real-time have 400 ms together, ever.
//
// Not seen: a thread that is lent a priority for less than 8 ms, between two looks; a process of
// somebody who died before the board was opened (in a static constructor).
//
// No heap: in the warden's process.
#pragma once

#include <sys/types.h>

#include <string_view>

#include "base/fixed_vector.h"
#include "base/time.h"
#include "board/linux/kernel/held_thread.h"
#include "board/linux/kernel/thread_times.h"
#include "board/linux/loop/warden_pages.h"

namespace qduino::board::linux {

/// What the kernel tells of a task.
struct TaskRank {
    std::string_view name;  ///< in the text that was read
    int effective = 0;      ///< below 0: real-time, −1 − its priority
    int policy = 0;         ///< what it asked for itself: SCHED_…
    int core = 0;

    [[nodiscard]] bool ranked_itself() const;
    [[nodiscard]] bool lent() const { return effective < 0 && !ranked_itself(); }
    /// SCHED_FIFO; 0: an ordinary one.
    [[nodiscard]] int priority() const { return effective < 0 ? -1 - effective : 0; }
};

/// What the text of a /proc/…/stat says. All zero where it is none.
[[nodiscard]] TaskRank task_rank(std::string_view stat);

class Strangers {
  public:
    static constexpr Nanoseconds kLookEvery = 8ms;

    /// What is asked of the warden.
    struct Wards {
        virtual ~Wards() = default;
        /// A thread of the board's, or one that it has ranked itself.
        [[nodiscard]] virtual bool has(pid_t tid) const = 0;
        /// Charges `used` to the loop that lends `priority` on `core`. kNoVcpu: there is none.
        virtual VcpuId charge(int priority, int core, Nanoseconds used) = 0;
    };

    /// All threads of this instant count as known, whoever made them. `grows`: more may come.
    void open(pid_t sketch, bool grows, WardenFindings& findings, Wards& wards);
    [[nodiscard]] Instant next_look() const { return next_look_; }
    void look(Instant now);
    /// New threads and processes, too.
    void sweep(Instant now);
    /// What waitpid() told.
    void changed(pid_t tid, int status);

  private:
    struct Stranger {
        pid_t process = 0;
        pid_t tid = 0;
        int stat_file = -1;
        ThreadTimesFile times;
        Nanoseconds cpu{};  // at the last look
        bool gone = false;
    };
    using Processes = FixedVector<pid_t, 64>;
    void find_new(bool known);
    void find_in(int folder, pid_t process, bool known, Processes& processes);
    void meet(pid_t process, pid_t tid, bool known);
    void add_children(pid_t process, pid_t tid, Processes& processes) const;
    void look_at(Stranger& stranger);
    void depose(const Stranger& stranger, std::string_view name);
    void hold_for_good(pid_t tid);
    StrangerFindings* finding_of(pid_t tid, std::string_view name);
    [[nodiscard]] bool are_watched() const;
    [[nodiscard]] unsigned long thread_count() const;
    template <typename Function>
    static void for_each_thread(int folder, const Function& function);

    pid_t sketch_ = 0;
    int folder_ = -1;
    bool grows_ = false;
    unsigned long threads_ = 0;  // as of the last sweep
    std::uint32_t fresh_ = 0;    // threads that came after the loops had begun
    int deposed_ = 0;            // had made themselves real-time
    Instant next_look_ = kForever;
    WardenFindings* findings_ = nullptr;
    Wards* wards_ = nullptr;
    FixedVector<Stranger, 64> strangers_;
    FixedVector<HeldThread, 32> held_;
};

}  // namespace qduino::board::linux
