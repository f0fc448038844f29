// The chains of a sketch: which loops lead from an event to the output that answers it, and what
// admission makes of them.
//
//   Chain stop{"stop button"};                              arduino/core/chain.h
//     ──► ChainDeclaration ──► Plan::add_chain() ──► ChainVerdict (sched/chain.h has the bound)
//                                              └───► ChainWatch: what was seen (chain_watch.h)
#pragma once

#include <utility>

#include "base/fixed_string.h"
#include "board/types.h"
#include "sched/chain.h"
#include "sched/explain.h"

namespace qduino::runtime {

using sched::kChainLimit;

struct Chain {
    /// What it begins with: an input that the first loop reads; an edge, whose handler is the first
    /// stage; a device's interrupt, whose bottom half is.
    enum class Source : std::uint8_t { none, read, edge, device };
    using Words = FixedString<40>;

    Words name;
    Source source = Source::none;
    board::PinId pin;                                     ///< edge
    board::DeviceClass device = board::DeviceClass::all;  ///< device
    /// For people; `to` is empty until it is said.
    Words from, to;
    /// A sketch's declaration has the loops alone; in a plan the I/O VCPU stands in front of them.
    sched::ChainStages stages;
    sched::ChainLimits limits;
    const char* wrong = nullptr;  ///< why its declaration cannot stand

    /// Something is said of it.
    [[nodiscard]] bool is_declared() const {
        return source != Source::none || !stages.empty() || !to.empty();
    }
    [[nodiscard]] bool has_handler() const { return source == Source::edge || source == Source::device; }
};

struct ChainVerdict {
    Chain chain;
    sched::ChainBound bound;
    FixedString<120> wrong;  ///< why it has no bound; empty: it has one
    [[nodiscard]] bool holds() const { return wrong.empty() && chain.limits.hold(bound); }
};
using ChainVerdicts = FixedVector<ChainVerdict, kChainLimit>;

/// Contract: `admission` is that of every loop.
[[nodiscard]] ChainVerdict judge(const Chain& chain, const sched::MulticoreAdmission& admission);

/// "stop button: reaction 23 ms > 20 ms"; of one that holds: its bounds.
[[nodiscard]] FixedString<200> in_short(const ChainVerdict& verdict);

/// "pin 2 > io 33 > loop 1 > ring > loop 3 > pin 9".
[[nodiscard]] FixedString<240> way_of(const Chain& chain);

/// Its bounds; of one that does not hold also who takes the time. Lines as sched::Explanation has
/// them.
void explain(sched::Explanation& out, const ChainVerdict& verdict);

/// A chain as a sketch declares it, from its construction on. Host thread only; setup-time.
class ChainDeclaration {
  public:
    explicit ChainDeclaration(const char* name) {
        chain_.name = name;
        ChainDeclaration** last = &first_;
        while (*last) last = &(*last)->next_;
        *last = this;
    }
    ~ChainDeclaration() {
        ChainDeclaration** at = &first_;
        while (*at != this) at = &(*at)->next_;
        *at = next_;
    }
    ChainDeclaration(const ChainDeclaration&) = delete;
    ChainDeclaration& operator=(const ChainDeclaration&) = delete;

    [[nodiscard]] Chain& chain() { return chain_; }

    /// Calls `visit` with each, in the order of their construction, and forgets what it declares
    /// but for its name: a second run in one process declares all of it once more.
    template <typename Visit>
    static void take_each(Visit visit) {
        for (ChainDeclaration* at = first_; at; at = at->next_) {
            const Chain::Words name = at->chain_.name;
            visit(std::exchange(at->chain_, {}));
            at->chain_.name = name;
        }
    }

  private:
    static inline ChainDeclaration* first_ = nullptr;
    ChainDeclaration* next_ = nullptr;
    Chain chain_;
};

}  // namespace qduino::runtime
