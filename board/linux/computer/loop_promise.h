// Tells the other programs of this computer which loops a sketch runs on which core, and the
// sketch's guarantee report which process trees have a VCPU there (core_promises.h).
//
// The loops come first: no tree takes time from them, and no tree keeps them from starting. But a
// tree that was admitted before the sketch came may get its budget too late from then on. The
// report says so.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "board/guarantee.h"
#include "board/linux/computer/core_promises.h"
#include "board/types.h"

namespace qduino::board::linux {

/// What other programs of this computer have been promised on a core.
struct Neighbours {
    bool loops = false;  ///< real-time ones, of another process
    /// Process trees, below all loops: the sum of their budgets, in the shortest of their periods;
    /// budget 0: none.
    sched::VcpuParameters below{};
};

/// As the register has them now; none where it cannot be read. Setup-time. `root` precedes the
/// register's folders (tests).
[[nodiscard]] Neighbours neighbours_on(int core, const std::string& root);

class LoopPromise {
  public:
    /// Promises what `specs` ask for, with what each activation costs. Where the register cannot be
    /// written, trees are admitted without knowing of these loops. Setup-time. `root` precedes the
    /// register's folders (tests).
    void make(std::span<const VcpuSpec> specs,
              const std::function<sched::PlatformOverheads(int core)>& overheads, const std::string& root);
    /// VCPU `id` has another budget and period: the promise is written anew, in its place.
    void change(VcpuId id, sched::VcpuParameters parameters);
    /// Adds the trees on the cores of these loops, each with its verdict as of now.
    void describe_trees(GuaranteeReport& report) const;

  private:
    std::string root_;
    std::vector<int> cores_;
    Promise promise_;
    std::vector<Nanoseconds> activations_;  // what each activation of its VCPUs costs
    HeldPromise held_;
};

}  // namespace qduino::board::linux
