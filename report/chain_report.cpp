#include "report/chain_report.h"

#include "base/text.h"
#include "terminal/human.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

/// A loop of the chain that has passed again and again, and waited for no period, though the chain
/// counts on that; 0: none.
board::VcpuId never_waits(const runtime::Runtime& runtime, const runtime::Chain& chain) {
    for (const sched::ChainStage& stage : chain.stages) {
        const runtime::Loop* const loop = stage.vcpu <= board::kMaxLoop ? runtime.loop(stage.vcpu) : nullptr;
        if (!loop || stage.pass > Nanoseconds{0}) continue;
        if (loop->statistics.releases.get() <= 1 && loop->statistics.passes.get() > 1) return stage.vcpu;
    }
    return board::kNoVcpu;
}

bool is_beyond(const ChainSeen& seen) {
    const sched::ChainBound& bound = seen.chain->bound;
    return seen.reaction > bound.reaction || (bound.has_age && seen.age > bound.age);
}

std::string seen_against(const char* what, Nanoseconds seen, Nanoseconds bound) {
    return text<std::string>(what, ' ', human_duration(seen), " at worst, bound ", human_duration(bound),
                             seen > bound ? ": BEYOND IT" : "");
}

}  // namespace

std::vector<ChainSeen> chains_seen(const runtime::Runtime& runtime) {
    std::vector<ChainSeen> seen;
    const runtime::ChainVerdicts& chains = runtime.plan().chains();
    for (std::size_t i = 0; i < chains.size(); ++i) {
        const runtime::ChainWatch* const watch = runtime.chain_watch(i);
        if (watch) seen.push_back({&chains[i], watch->count(), watch->reaction(), watch->age()});
    }
    return seen;
}

std::string chain_lines(const runtime::Runtime& runtime) {
    std::string out;
    for (const ChainSeen& seen : chains_seen(runtime)) {
        const runtime::Chain& chain = seen.chain->chain;
        const sched::ChainBound& bound = seen.chain->bound;
        auto line = text<std::string>("Chain ", chain.name, ": ");
        const bool device = chain.source == runtime::Chain::Source::device;
        if (seen.count == 0) {
            line += "nothing came through it";
        } else {
            write(line, seen_against("reaction", seen.reaction, bound.reaction), " (",
                  counted(seen.count, "reaction"), device ? ", from the first loop on)" : ")");
            if (bound.has_age) write(line, "; ", seen_against("age", seen.age, bound.age));
        }
        if (const board::VcpuId loop = never_waits(runtime, chain); loop != board::kNoVcpu)
            write(line, ". Loop ", loop,
                  " waits for no period, and the bound counts with its releases: end them with "
                  "waitForNextPeriod(), or say how long a pass is, through(loop, pass)");
        out += wrapped(line + ".", "");
    }
    return out;
}

std::string chain_verdict(const runtime::Runtime& runtime) {
    std::string out;
    for (const ChainSeen& seen : chains_seen(runtime)) {
        if (is_beyond(seen))
            write(out, out.empty() ? "; BEYOND ITS BOUND: chain " : ", chain ", seen.chain->chain.name);
    }
    return out;
}

}  // namespace qduino::apps
