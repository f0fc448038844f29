#include "board/linux/computer/tree_admission.h"

#include <time.h>

#include <algorithm>
#include <vector>

#include "base/text.h"
#include "sched/admission.h"

namespace qduino::board::linux {
namespace {

constexpr Nanoseconds kFairLatency = 24ms;

/// One core as the tree sees it.
struct TreeLoad {
    sched::CoreLoad load;
    Nanoseconds longest{};  // period
    std::string above;
    std::string owner;       // of the whole core; empty: nobody
    bool full = false;       // more than the analysis takes
    int trees = 0;           // besides this one
    bool is_sibling = true;  // of all of them
};

std::string in_words(const auto& vcpu) { return text<std::string>(vcpu.budget, " in ", vcpu.period); }

void add_name(TreeLoad& core, const std::string& name) {
    write(core.above, core.above.empty() ? "" : ", ", name);
}

void add_loop(TreeLoad& core, const Promise& promise, sched::Vcpu vcpu) {
    const auto name = text<std::string>(vcpu.is_io() ? "io " : "loop ", int{vcpu.id}, " of ", promise.program,
                                        " (", in_words(vcpu), ')');
    if (!vcpu.is_io() && vcpu.parameters().whole_core()) core.owner = name;
    // Loops of two sketches may have one number: here each has its own.
    vcpu.id = static_cast<sched::VcpuId>(1 + core.load.mains.size() + core.load.ios.size());
    core.longest = std::max(core.longest, vcpu.period);
    core.full = core.full || !core.load.try_add(vcpu);
    add_name(core, name);
}

/// Two sketches of one core have measured the same platform: it counts once.
void add_taker(TreeLoad& core, const sched::PlatformInterferer& taker) {
    auto& takers = core.load.overheads.interferers;
    const auto same = [&taker](const auto& each) { return each.name.view() == taker.name.view(); };
    if (const auto found = std::find_if(takers.begin(), takers.end(), same); found != takers.end()) {
        if (taker.interference(found->interval) > found->cost) *found = taker;
        return;
    }
    core.load.overheads.add(taker);
}

/// What comes before a tree of `core` that is a child of `parent`, but for other trees.
TreeLoad load_above(int core, const std::string& parent, std::span<const Promise> promises) {
    TreeLoad found;
    found.load.core = core;
    for (const Promise& promise : promises) {
        for (const sched::Vcpu& vcpu : promise.vcpus) {
            if (vcpu.core == core) add_loop(found, promise, vcpu);
        }
        for (const auto& [where, taker] : promise.takers) {
            if (where == core) add_taker(found, taker);
        }
        for (const TreeVcpu& tree : promise.trees) {
            if (tree.core != core) continue;
            ++found.trees;
            found.is_sibling = found.is_sibling && tree.parent == parent;
            add_name(found, text<std::string>(tree.name, " (", in_words(tree), ')'));
        }
    }
    return found;
}

/// Each of the other trees as a deferrable server.
TreeLoad with_servers(TreeLoad core, std::span<const Promise> promises) {
    int number = 0;
    for (const Promise& promise : promises) {
        for (const TreeVcpu& tree : promise.trees) {
            if (tree.core != core.load.core) continue;
            add_taker(core, {.name = text<FixedString<23>>("tree ", ++number),
                             .cost = tree.budget,
                             .interval = tree.period,
                             .jitter = tree.period - tree.budget});
        }
    }
    add_taker(core, {.name = FixedString<23>{"overdrawn ticks"},
                     .cost = core.trees * tick_period(),
                     .interval = sched::kPeriodMax,
                     .jitter = {}});
    return core;
}

/// Each of the other trees as one with an equal share, while this one has `budget` to get.
TreeLoad with_shares(TreeLoad core, Nanoseconds budget) {
    add_taker(core, {.name = FixedString<23>{"equal shares"},
                     .cost = core.trees * (budget + kFairLatency + tick_period()),
                     .interval = sched::kPeriodMax,
                     .jitter = {}});
    return core;
}

/// R of `budget` below `core` and beside the trees of `promises`, which are not in `core` yet;
/// beyond `limit` when it is above that.
Nanoseconds response_below(const TreeLoad& core, std::span<const Promise> promises, Nanoseconds budget,
                           Nanoseconds limit) {
    if (core.full) return limit + Nanoseconds{1};
    if (core.trees == 0) return sched::response_below_all(core.load, budget, limit);
    const Nanoseconds served = sched::response_below_all(with_servers(core, promises).load, budget, limit);
    if (!core.is_sibling) return served;
    return std::min(served, sched::response_below_all(with_shares(core, budget).load, budget, limit));
}

/// The largest budget in whole milliseconds that is admitted in `period`; 0: none.
Nanoseconds largest_budget(const TreeLoad& core, std::span<const Promise> promises, Nanoseconds period) {
    std::int64_t fits = 0, too_much = period / 1ms + 1;
    while (too_much - fits > 1) {
        const std::int64_t middle = (fits + too_much) / 2;
        (response_below(core, promises, middle * 1ms, period) <= period ? fits : too_much) = middle;
    }
    return fits * 1ms;
}

std::string refusal_of(const TreeVcpu& tree, const TreeLoad& core, Nanoseconds most) {
    auto out = text<std::string>(in_words(tree), " does not fit on core ", tree.core, ": R > ", tree.period,
                                 ". Before it come ", core.above);
    if (most > Nanoseconds{0}) return write(out, ". At most ", most, " in ", tree.period, " would fit");
    return out += ". Take another core or a longer period, or stop one of them";
}

}  // namespace

Nanoseconds tick_period() {
    constexpr Nanoseconds kLongest = 10ms;
    timespec resolution{};
    if (::clock_getres(CLOCK_MONOTONIC_COARSE, &resolution) != 0) return kLongest;
    return Nanoseconds{resolution.tv_sec * 1'000'000'000LL + resolution.tv_nsec};
}

TreeVerdict admit_tree(const TreeVcpu& tree, std::span<const Promise> promises) {
    const TreeLoad core = load_above(tree.core, tree.parent, promises);
    TreeVerdict verdict;
    verdict.above = core.above;
    if (!core.owner.empty()) {
        verdict.response = tree.period + Nanoseconds{1};
        verdict.refusal = text<std::string>(core.owner, " owns core ", tree.core,
                                            ": take another core, or stop that sketch");
    } else if (core.full) {
        verdict.response = tree.period + Nanoseconds{1};
        verdict.refusal = text<std::string>("core ", tree.core, " has more VCPUs than admission takes (",
                                            core.above, "): take another core, or stop one of them");
    } else {
        verdict.response = response_below(core, promises, tree.budget, tree.period);
        verdict.admitted = verdict.response <= tree.period;
        if (verdict.admitted) return verdict;
        verdict.largest = largest_budget(core, promises, tree.period);
        verdict.refusal = refusal_of(tree, core, verdict.largest);
    }
    return verdict;
}

TreeVerdict admit_what_fits(TreeVcpu& tree, Nanoseconds least, std::span<const Promise> promises) {
    const TreeVerdict verdict = admit_tree(tree, promises);
    if (verdict.admitted || verdict.largest < least || verdict.largest >= tree.budget) return verdict;
    tree.budget = verdict.largest;
    return admit_tree(tree, promises);
}

TreeVerdict admit_newcomer(const TreeVcpu& tree, std::span<const Promise> promises) {
    TreeVerdict verdict = admit_tree(tree, promises);
    for (std::size_t i = 0; i < promises.size() && verdict.admitted; ++i) {
        if (promises[i].trees.empty() || promises[i].trees[0].core != tree.core) continue;
        const TreeVcpu& other = promises[i].trees[0];
        std::vector<Promise> rest{promises.begin(), promises.end()};
        rest[i].trees.clear();
        if (!admit_tree(other, rest).admitted) continue;  // late without the newcomer, too
        rest[i].trees.push_back(tree);
        if (admit_tree(other, rest).admitted) continue;
        verdict.admitted = false;
        verdict.refusal =
            text<std::string>(in_words(tree), " on core ", tree.core, " would make ", other.name, " (",
                              in_words(other), ") late: take another core, a smaller budget, or stop it");
    }
    return verdict;
}

}  // namespace qduino::board::linux
