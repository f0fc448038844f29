// What a chain really took: the worst reaction and the greatest age that were seen.
//
// Nothing looks into the data. A release is taken to read when it begins and to write when it ends.
// So it hands on, to the next stage, when its data was read first:
//
//   loop 1   │begins: stamp = now   ends│► link ─┐
//   loop 2                                       └► │begins: takes it   ends│► age = now − stamp
//
// An input that changed just behind the first stage's read is in no output before one of a later
// stamp. So the reaction is from the stamp of the output before to the first output with another
// one (M. Günzel et al., "On the Equivalence of Maximum Reaction Time and Maximum Data Age for
// Cause-Effect Chains", ECRTS 2023). In a chain that begins with an edge each edge is followed, and
// the oldest where several wait for a stage.
//
// Each stage calls for itself, from its own VCPU. Allocates and locks nothing. What was seen may be
// read meanwhile, by any thread: each figure whole, but not all of the same instant.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "base/time.h"
#include "runtime/chain.h"

namespace qduino::runtime {

class ChainWatch {
  public:
    /// Contract: the verdict has a bound.
    explicit ChainWatch(const ChainVerdict& verdict)
        : chain_(verdict.chain), follows_edges_(verdict.chain.source == Chain::Source::edge) {
        set_bound(verdict.bound);
    }

    /// As it was declared: that never changes.
    [[nodiscard]] const Chain& chain() const { return chain_; }
    /// A change at run time gives it another bound. By one thread at a time.
    void set_bound(const sched::ChainBound& bound) {
        reaction_bound_ns_.store(bound.reaction.count(), std::memory_order_relaxed);
        age_bound_ns_.store(bound.has_age ? bound.age.count() : kNoAge, std::memory_order_relaxed);
    }
    [[nodiscard]] Nanoseconds reaction_bound() const { return in_ns(reaction_bound_ns_); }
    /// Below 0: it has no age.
    [[nodiscard]] Nanoseconds age_bound() const { return in_ns(age_bound_ns_); }

    /// A run of the first stage's handler, for what came at `came` (kForever: nobody knows when).
    void begins_with_edge(Instant came) { held_[0] = came == kForever ? Data{} : Data{to_ns(came), 0}; }

    /// Stage `k`, a loop, begins a release.
    void begins(std::size_t k, Instant now) {
        Data& held = held_[k];
        if (is_first(k)) {
            held = {to_ns(now), to_ns(now)};
            return;
        }
        Link& link = links_[k - 1];
        const std::int64_t waiting = link.waiting.exchange(kNone, std::memory_order_acq_rel);
        if (follows_edges_) {
            held = {waiting, 0};
        } else {
            held = {link.oldest.load(std::memory_order_acquire),
                    link.freshest.load(std::memory_order_acquire)};
            if (chain_.stages[k].queued && waiting != kNone) held.oldest = waiting;
        }
    }

    /// Stage `k` ends a release, or a run of its handler.
    void ends(std::size_t k, Instant now) {
        const Data held = held_[k];
        if (follows_edges_) held_[k] = {};
        if (held.oldest == kNone) return;
        if (k + 1 == chain_.stages.size()) return note_output(held, to_ns(now));
        Link& link = links_[k];
        link.oldest.store(held.oldest, std::memory_order_release);
        link.freshest.store(held.freshest, std::memory_order_release);
        std::int64_t nothing = kNone;
        link.waiting.compare_exchange_strong(nothing, held.oldest, std::memory_order_acq_rel);
    }

    // ---- what was seen so far -------------------------------------------------------------------
    [[nodiscard]] Nanoseconds reaction() const { return in_ns(worst_reaction_ns_); }
    [[nodiscard]] Nanoseconds age() const { return in_ns(worst_age_ns_); }
    /// Reactions seen; 0: nothing came through.
    [[nodiscard]] std::int64_t count() const { return count_.load(std::memory_order_relaxed); }
    /// What a device brings cannot be seen: its chain is followed from the first loop on.
    [[nodiscard]] bool begins_at_a_loop() const { return chain_.source == Chain::Source::device; }

  private:
    using Figure = std::atomic<std::int64_t>;
    static constexpr std::int64_t kNoAge = -1;
    static Nanoseconds in_ns(const Figure& figure) {
        return Nanoseconds{figure.load(std::memory_order_relaxed)};
    }
    /// The last stage's VCPU alone raises these: no read-modify-write is needed.
    static void raise(Figure& figure, std::int64_t value) {
        if (value > figure.load(std::memory_order_relaxed)) figure.store(value, std::memory_order_relaxed);
    }
    static constexpr std::int64_t kNone = INT64_MIN;
    /// When what a stage works on was read first.
    struct Data {
        std::int64_t oldest = kNone;
        std::int64_t freshest = 0;
    };
    struct Link {
        std::atomic<std::int64_t> oldest{kNone};
        std::atomic<std::int64_t> freshest{0};
        std::atomic<std::int64_t> waiting{kNone};  ///< the first that came since the reader looked
    };

    [[nodiscard]] bool is_first(std::size_t k) const { return k == 0 || (k == 1 && begins_at_a_loop()); }
    void note_output(const Data& held, std::int64_t now) {
        if (follows_edges_) return note_reaction(now - held.oldest);
        raise(worst_age_ns_, now - held.oldest);
        if (held.freshest == last_output_) return;
        if (last_output_ != kNone) note_reaction(now - last_output_);
        last_output_ = held.freshest;
    }
    void note_reaction(std::int64_t ns) {
        count_.store(count() + 1, std::memory_order_relaxed);
        raise(worst_reaction_ns_, ns);
    }

    const Chain chain_;
    const bool follows_edges_;
    Figure reaction_bound_ns_{0}, age_bound_ns_{kNoAge};
    std::array<Data, sched::kChainStageLimit> held_{};   // each its stage's own
    std::array<Link, sched::kChainStageLimit> links_{};  // behind each stage
    // The last stage's own.
    std::int64_t last_output_ = kNone;
    Figure count_{0}, worst_reaction_ns_{0}, worst_age_ns_{0};
};

/// Where a loop or a handler stands in a chain.
struct ChainPlace {
    ChainWatch* watch = nullptr;
    std::size_t stage = 0;
};

}  // namespace qduino::runtime
