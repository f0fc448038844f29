// A VCPU for a process tree: admitted, written down for all programs of this computer, kept by the
// kernel, and put away again.
//
//   make()     puts away what killed keepers left; admits (tree_admission.h); promises
//              (core_promises.h); makes the control group (cpu_group.h); posts a witness
//   enter()    in the child, between fork and exec: everything that it starts stays inside
//   ~          kills what is left of the tree; removes the group and the promise
#pragma once

#include <string>

#include "base/result.h"
#include "board/linux/computer/core_promises.h"
#include "board/linux/computer/tree_admission.h"
#include "board/linux/kernel/cpu_group.h"
#include "posix/unique_fd.h"

namespace qduino::apps {

struct ProcessVcpuOptions {
    board::linux::TreeVcpu tree;  ///< core kAnyCore: the first that admits it
    /// Keep the tree to its budget also when it is not admitted. Otherwise nothing is made then.
    bool also_when_refused = false;
    /// When this process is killed, the witness asks the tree to end; false: it is asked anyway.
    bool witness_asks = true;
    Nanoseconds witness_grace = 2s;
};

class ProcessVcpu {
  public:
    ProcessVcpu() = default;  ///< none
    ProcessVcpu(ProcessVcpu&&) = default;
    ProcessVcpu& operator=(ProcessVcpu&&) = delete;
    ~ProcessVcpu();

    /// From a process with one thread. Errors: invalid_argument (a budget or a core that cannot
    /// be), unsupported and not_permitted (no control group: what to do), and what the kernel says.
    [[nodiscard]] static Result<ProcessVcpu> make(ProcessVcpuOptions options);

    /// False: it was refused, and verdict() says why.
    [[nodiscard]] bool active() const { return promise_.held(); }
    [[nodiscard]] const board::linux::TreeVcpu& tree() const { return tree_; }
    [[nodiscard]] const board::linux::TreeVerdict& verdict() const { return verdict_; }
    /// Admits it anew, beside what is promised now.
    void admit_again();
    /// The same with the largest budget of `least` to `asked`, in whole milliseconds, that is
    /// admitted now. Where not even `least` is, nothing is gained by less: it has `asked`, and
    /// verdict() says why it may not get it.
    void take_what_fits(Nanoseconds asked, Nanoseconds least);
    [[nodiscard]] const board::linux::CpuGroup& group() const { return group_; }
    /// "cgroup v2"
    [[nodiscard]] const char* enforced_by() const {
        return group_.second_version() ? "cgroup v2" : "cgroup v1";
    }

  private:
    [[nodiscard]] board::linux::Promise promise() const;
    [[nodiscard]] Result<void> choose_core(std::span<const board::linux::Promise> promises);

    board::linux::TreeVcpu tree_;
    board::linux::TreeVerdict verdict_;
    board::linux::CpuGroup group_{{}, ""};
    board::linux::HeldPromise promise_;
    posix::UniqueFd witness_;
};

}  // namespace qduino::apps
