// The plan of a sketch: its loops and I/O VCPUs, admitted and placed on cores, or the reason why
// not.
//
//   SketchTable ──► add_loops() ─────────┐
//   interruptsVcpu(), attach… ──► add_io() ┤
//   Mutex ──► add_section() ───────────────┴─► admit() ──► cores, or a refusal
//
// One admission, after setup(): what a core has to bear is known only when setup() has routed the
// interrupts and declared its bottom halves and critical sections. When that changes while the
// loops run, the core is judged again where it stands: admit_again(), change_io().
//
// A budget that is lowered while the loops run is not free at once. A release that began before may
// have met the old budget already, and would now meet one that was raised in its place:
//
//   loop 1   |███   ▒▒▒   ███ ···    release ─► end
//   io 33          old ▒       │ lowered
//   io 34                      │ raised   ▒▒▒▒▒ new
//
// So the lowered one counts with its old budget for one longest period of a loop on that core. So
// do interrupts that were routed away.
#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/fixed_vector.h"
#include "base/result.h"
#include "board/types.h"
#include "runtime/chain.h"
#include "runtime/sketch.h"
#include "sched/explain.h"
#include "sched/placement.h"

namespace qduino::runtime {

/// Setup-time only; allocates.
class Plan {
  public:
    /// `enforce` false: everything is placed, whatever admission says of it.
    explicit Plan(bool enforce);

    /// Takes the loops of a sketch, and, called again, those that have come since. Error: a
    /// declaration that cannot stand, and where it is.
    Result<void> add_loops(const SketchTable& table);
    /// Adds an I/O VCPU and returns its number. Error: unavailable when all numbers are taken.
    Result<board::VcpuId> add_io(Nanoseconds budget, Nanoseconds period, int core);
    /// Beyond what the table holds nothing is added, and admit() refuses.
    void add_section(const sched::CriticalSection& section);
    /// A pin more whose edges have a handler on I/O VCPU `id`. Where the board does not know how
    /// often edges come, admit() refuses.
    void add_edges(board::VcpuId id, board::EdgeCost cost);
    /// What is declared cannot stand, and why: admit() refuses with the first of these.
    void refuse(const std::string& reason);

    /// Judged with all else: a chain that does not keep its limits is a refusal. Beyond 16 none is
    /// added, and admit() refuses.
    void add_chain(const Chain& chain);

    /// Declares I/O VCPU `id` anew. Before admit().
    void redeclare_io(board::VcpuId id, sched::VcpuParameters parameters, int core);
    /// Takes an I/O VCPU back out: nothing will run on it.
    void remove_io(board::VcpuId id);
    /// Where it names no core, I/O VCPU `id` is put on none of these, a bit for each. Before
    /// admit().
    void keep_off(board::VcpuId id, std::uint64_t cores);
    /// Gives `core` to the one loop that names it, whatever its budget is. False: none does, or two
    /// VCPUs. Before admit().
    [[nodiscard]] bool give_core(int core);

    /// Judges all of it. `overheads` has an entry for each core. Error: the first refusal, naming
    /// the loop and where it is declared; explanation() has it at length.
    Result<void> admit(const std::vector<sched::PlatformOverheads>& overheads);
    /// Judges every core once more, with other overheads, which it keeps when all are admitted.
    /// `overheads` has an entry for each core; those of a core that nobody shares do not count.
    /// Error: the refusal, in one line, which names `change`; nothing is kept, on no core.
    /// Allocates nothing.
    Result<void> admit_again(std::span<const sched::PlatformOverheads> overheads, const char* change,
                             Instant now);

    /// Gives I/O VCPU `id` another budget and period at `now`, when its core can bear that. Error:
    /// not_found, invalid_argument, or the refusal, in one line; nothing is changed then. Allocates
    /// nothing. Contract: admit() was called.
    Result<void> change_io(board::VcpuId id, sched::VcpuParameters parameters, Instant now);

    /// R of the loop `id` if each release of it slept so long, in so many pieces. Contract:
    /// admitted.
    [[nodiscard]] sched::LoopResponse response_with_sleep(board::VcpuId id, Nanoseconds sleep,
                                                          int pieces) const;

    /// How long, at least, a release of the loop `id` may sleep in all, in one sleep more than it
    /// declares; 0: not at all. Contract: admitted.
    [[nodiscard]] Nanoseconds room_for_sleep(board::VcpuId id) const;

    /// How each chain stands; none before admission, or without it.
    [[nodiscard]] const ChainVerdicts& chains() const { return chains_; }
    /// The longest period of the loop `id` with which `chain` keeps its limits, all else unchanged;
    /// 0: none (sched/chain.h). Contract: the loops are admitted.
    [[nodiscard]] Nanoseconds longest_period(const ChainVerdict& chain, board::VcpuId id) const;

    /// What the board is to be given, without entries and contexts, loops first.
    [[nodiscard]] std::vector<board::VcpuSpec> specs() const;
    /// The loop that has `core` for itself (budget == period, core named, nothing else there);
    /// kNoVcpu: none.
    [[nodiscard]] board::VcpuId owner_of(int core) const;
    /// Several VCPUs may come to be on `core`, or one that leaves some of it.
    [[nodiscard]] bool may_share(int core) const;
    /// What admit() said: the admission table, or the refusal at length.
    [[nodiscard]] const sched::Explanation& explanation() const { return explanation_; }
    /// The admission table of every core in use, and the chains, as the plan stands.
    [[nodiscard]] sched::Explanation admission_table() const;
    [[nodiscard]] bool admitted() const {
        return admission_->admitted && std::ranges::all_of(chains_, &ChainVerdict::holds);
    }
    [[nodiscard]] const sched::MulticoreAdmission& admission() const { return *admission_; }

  private:
    /// An I/O VCPU that had more until lately.
    struct Lowered {
        board::VcpuId id = board::kNoVcpu;
        sched::VcpuParameters had{};
        Instant until{};
    };

    /// Interrupts that a core had to bear until lately.
    struct RoutedAway {
        int core = 0;
        sched::PlatformInterferer had;
        Instant until{};
    };
    /// What of a core's load may change while the loops run.
    struct Changeable {
        sched::PlatformOverheads overheads;
        FixedVector<sched::Vcpu, sched::kIoVcpuLimit> ios;
    };

    void make_deferrable();
    [[nodiscard]] Result<void> refusal_in_short() const;
    /// Error: the first chain that does not hold.
    [[nodiscard]] Result<void> judge_chains(const char* change);
    void explain_chain(sched::Explanation& out, const ChainVerdict& chain) const;
    [[nodiscard]] bool fits(const sched::CoreLoad& load, bool with_promise_below);
    [[nodiscard]] Result<void> refuse_unknown() const;
    [[nodiscard]] Result<void> refuse_handlers_apart() const;
    void give_allowances();
    /// Writes the verdict on each core, as it is loaded now.
    void judge_all();
    /// Makes `change` to the loads of the cores when all of them can bear that; else the refusal of
    /// the first that cannot, and nothing is changed. What was lowered or routed away lately counts
    /// with what it had. Allocates nothing.
    template <typename Change>
    Result<void> judge(Change change, const char* name, Instant now);
    void save(std::vector<Changeable>& into) const;
    void restore(const std::vector<Changeable>& from);
    /// Error: too many changes within one release.
    Result<void> note_routed_away(Instant now);
    void note_lowered(const sched::CoreLoad& load, const sched::Vcpu& before, Instant now);
    void count_lowered(sched::CoreLoad& load, Instant now) const;

    bool enforce_;
    bool too_many_sections_ = false;
    bool too_many_chains_ = false;
    ChainVerdicts declared_chains_, chains_;
    std::string refused_;  // the first reason; empty: none
    std::vector<LoopDeclaration> declarations_;
    sched::CriticalSections sections_;
    std::vector<sched::Vcpu> requests_;
    FixedVector<Lowered, sched::kIoVcpuLimit> lowered_;  // one for each I/O VCPU at the most
    FixedVector<RoutedAway, 32> routed_away_;
    std::vector<Changeable> before_, asked_;  // of a change; by load
    std::unique_ptr<sched::MulticoreAdmission> admission_;
    sched::Explanation explanation_;
};

/// "loop 1" … "loop 32", "io 33" … "io 63".
[[nodiscard]] std::string vcpu_name(board::VcpuId id);

}  // namespace qduino::runtime
