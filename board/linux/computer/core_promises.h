// What the programs of this computer have been promised on its cores: the loops of sketches, and
// the VCPUs of process trees. Each program that holds a promise has a file, which it keeps locked:
//
//   /run/qduino/qduino-promise.4711.0    root's; shared_file.h says where other users' lie
//     program printer
//     main 1 0 30120000 100000000         a loop: id, core, budget and period in ns. What an
//     io 33 0 1000000 100000000           activation costs is in the budget. What else there is
//                                         of a sched::Vcpu follows, in its order
//     taker 0 5000 1000000 0 tick         core, cost, interval, jitter, name: the platform itself
//     peak 400000 90000                   of the taker above, for short windows (sched/load.h)
//     tree 0 10000000 100000000 printd    a process tree: core, budget, period, name
//     group /sys/fs/cgroup/cpu/qduino-vcpu.4711.0    a control group that was made for the tree
//
// The lock ends with its holder, however that dies. So a file that nobody has locked is a dead
// program's: its promise counts no more, and the next program that makes a promise removes its
// file and its groups. A program writes its file before it makes a group: no group is without a
// record.
//
// Reading the promises, admitting another one and writing that down is one step, under the lock on
// "qduino-promises.lock". The register is advisory, as core_lock.h is: other real-time programs do
// not know of it.
#pragma once

#include <sys/types.h>

#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "board/linux/kernel/shared_file.h"
#include "posix/unique_fd.h"
#include "sched/load.h"

namespace qduino::board::linux {

/// A process tree of ordinary tasks that is held to a budget, below every real-time loop.
struct TreeVcpu {
    std::string name;  ///< as a person reads it
    int core = 0;
    Nanoseconds budget{};
    Nanoseconds period{};
    /// Folder of the control group in which its own was made: siblings have equal shares.
    std::string parent = {};
};

/// The promise of one program.
struct Promise {
    struct Taker {
        int core = 0;
        sched::PlatformInterferer interferer;
    };

    std::string program;             ///< as in /proc/PID/comm
    int pid = 0;                     ///< of the holder
    std::vector<sched::Vcpu> vcpus;  ///< real-time
    std::vector<Taker> takers;       ///< above them
    std::vector<TreeVcpu> trees;
    std::vector<std::string> groups;  ///< folders, the deepest first
    std::string path;                 ///< of its file
    uid_t owner = 0;                  ///< of its file
};

/// A promise that holds as long as this object, or a process that inherited the descriptor, lives.
using HeldPromise = HeldFile;

/// The register, locked: no other program reads or changes it meanwhile. Keep it for milliseconds.
/// Setup-time only; allocates.
class PromiseRegister {
  public:
    /// `root` precedes the folders (tests). Errors: not_permitted (no folder is this user's alone),
    /// timed_out (a program holds the register for longer than `patience`), and what the kernel
    /// says.
    static Result<PromiseRegister> open(const std::string& root = "", Nanoseconds patience = 5s);

    /// The promises of programs that live, this one's included.
    [[nodiscard]] const std::vector<Promise>& living() const { return living_; }
    /// What dead programs left, and this user may take away.
    [[nodiscard]] const std::vector<Promise>& dead() const { return dead_; }
    /// Removes the files of dead programs, and the control groups that they left: waits up to
    /// `patience` for each of these. What cannot be removed keeps its record. Setup-time.
    void put_dead_away(Nanoseconds patience) const;
    /// Where the next promise of this process will be written: the last part of the name is free.
    [[nodiscard]] std::string free_name() const;
    /// Writes `promise` down as file `name`, of free_name(). Error: what the kernel says.
    [[nodiscard]] Result<HeldPromise> hold(const Promise& promise, const std::string& name) const;
    /// Writes `promise` in the place of what is held.
    static void rewrite(const HeldPromise& held, const Promise& promise);

  private:
    void read();
    void read(const std::string& path, std::string_view name);

    std::string folder_;                 // this user's
    std::vector<std::string> believed_;  // all whose promises count
    posix::UniqueFd lock_;
    std::vector<Promise> living_, dead_;
};

/// The lines of a promise, as in its file.
[[nodiscard]] std::string promise_text(const Promise& promise);
/// Reads them; lines that are malformed, or out of range, are left out.
[[nodiscard]] Promise read_promise(std::string_view text);

}  // namespace qduino::board::linux
