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
// Each stage calls for itself, from its own VCPU. Allocates and locks nothing.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>

#include "base/time.h"
#include "runtime/chain.h"

namespace qduino::runtime {

class ChainWatch {
  public:
    explicit ChainWatch(const Chain& chain)
        : stages_(chain.stages), follows_edges_(chain.source == Chain::Source::edge) {}

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
            if (stages_[k].queued && waiting != kNone) held.oldest = waiting;
        }
    }

    /// Stage `k` ends a release, or a run of its handler.
    void ends(std::size_t k, Instant now) {
        const Data held = held_[k];
        if (follows_edges_) held_[k] = {};
        if (held.oldest == kNone) return;
        if (k + 1 == stages_.size()) return note_output(held, to_ns(now));
        Link& link = links_[k];
        link.oldest.store(held.oldest, std::memory_order_release);
        link.freshest.store(held.freshest, std::memory_order_release);
        std::int64_t nothing = kNone;
        link.waiting.compare_exchange_strong(nothing, held.oldest, std::memory_order_acq_rel);
    }

    // ---- at the end of a run --------------------------------------------------------------------
    [[nodiscard]] Nanoseconds reaction() const { return worst_reaction_; }
    [[nodiscard]] Nanoseconds age() const { return worst_age_; }
    /// Reactions seen; 0: nothing came through.
    [[nodiscard]] std::int64_t count() const { return count_; }

  private:
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

    /// What a device brings cannot be seen: from the first loop on.
    [[nodiscard]] bool is_first(std::size_t k) const {
        return k == 0 || (k == 1 && !follows_edges_ && stages_[0].vcpu > board::kMaxLoop);
    }
    void note_output(const Data& held, std::int64_t now) {
        if (follows_edges_) return note_reaction(now - held.oldest);
        worst_age_ = std::max(worst_age_, Nanoseconds{now - held.oldest});
        if (held.freshest == last_output_) return;
        if (last_output_ != kNone) note_reaction(now - last_output_);
        last_output_ = held.freshest;
    }
    void note_reaction(std::int64_t ns) {
        ++count_;
        worst_reaction_ = std::max(worst_reaction_, Nanoseconds{ns});
    }

    sched::ChainStages stages_;
    bool follows_edges_;
    std::array<Data, sched::kChainStageLimit> held_{};   // each its stage's own
    std::array<Link, sched::kChainStageLimit> links_{};  // behind each stage
    // The last stage's own.
    std::int64_t last_output_ = kNone;
    std::int64_t count_ = 0;
    Nanoseconds worst_reaction_{}, worst_age_{};
};

/// Where a loop or a handler stands in a chain.
struct ChainPlace {
    ChainWatch* watch = nullptr;
    std::size_t stage = 0;
};

}  // namespace qduino::runtime
