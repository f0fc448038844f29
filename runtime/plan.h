// The plan of a sketch: its loops and I/O VCPUs, admitted and placed on cores, or the reason why
// not.
//
//   SketchTable ──► add_loops() ┐
//   interruptsVcpu(), attach… ──► add_io() ┴─► sched::admit_all ──► core_of(id), or a refusal
//
// Invariant: the plan is admitted as a whole; a refused request leaves it as it was.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "board/types.h"
#include "runtime/sketch.h"
#include "sched/explain.h"
#include "sched/placement.h"

namespace qduino::runtime {

/// An I/O VCPU that was asked for and not admitted.
struct RefusedIo {
    sched::Vcpu vcpu;            ///< as asked
    sched::Refusal refusal;      ///< of it, or of a loop that would be late because of it
    int core = sched::kAnyCore;  ///< the core it asked for, or that came nearest
};

/// Setup-time only; allocates.
class Plan {
  public:
    /// `overheads` has an entry for each core. `enforce` false: everything is placed, whatever
    /// admission says of it.
    Plan(std::vector<sched::PlatformOverheads> overheads, bool enforce);

    /// Takes the loops of a sketch. Error: the first refusal, naming the loop and where it is
    /// declared; explanation() has it at length.
    Result<void> add_loops(const SketchTable& table);
    /// Adds an I/O VCPU and returns its number. Error: the refusal; unavailable when all numbers
    /// are taken.
    Result<board::VcpuId> add_io(Nanoseconds budget, Nanoseconds period, int core);

    /// Takes an I/O VCPU back out: nothing will run on it.
    void remove_io(board::VcpuId id);

    /// What the board is to be given, without entries and contexts, loops first.
    [[nodiscard]] std::vector<board::VcpuSpec> specs() const;
    /// The loop that has `core` for itself (budget == period, core named, nothing else there);
    /// kNoVcpu: none.
    [[nodiscard]] board::VcpuId owner_of(int core) const;
    /// What was said to the last request: the admission table, or the refusal at length.
    [[nodiscard]] const sched::Explanation& explanation() const { return explanation_; }
    /// The admission table of every core in use, as the plan stands.
    [[nodiscard]] sched::Explanation admission_table() const;
    [[nodiscard]] bool admitted() const { return admission_->admitted; }
    /// What add_io() has refused, in order.
    [[nodiscard]] const std::vector<RefusedIo>& refused_ios() const { return refused_ios_; }
    [[nodiscard]] const sched::MulticoreAdmission& admission() const { return *admission_; }

  private:
    /// `declarations`: those that are new, to say where a refused one stands.
    Result<void> admit(std::span<const LoopDeclaration> declarations);

    std::vector<sched::PlatformOverheads> overheads_;
    bool enforce_;
    std::vector<sched::Vcpu> requests_;
    std::unique_ptr<sched::MulticoreAdmission> admission_;
    sched::Explanation explanation_;
    std::vector<RefusedIo> refused_ios_;
};

/// "loop 1" … "loop 32", "io 33" … "io 63".
[[nodiscard]] std::string vcpu_name(board::VcpuId id);

}  // namespace qduino::runtime
