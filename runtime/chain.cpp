#include "runtime/chain.h"

#include "base/text.h"

namespace qduino::runtime {
namespace {

using namespace std::string_view_literals;
using sched::ChainFault;
using sched::Explanation;
using Line = FixedString<120>;

/// "loop 3", "io 33".
Line stage_name(board::VcpuId id) { return text<Line>(id <= board::kMaxLoop ? "loop "sv : "io "sv, id); }

Line fault_of(const Chain& chain, const sched::ChainBound& bound) {
    const Line at = stage_name(bound.at);
    switch (bound.fault) {
        case ChainFault::none:
            break;
        case ChainFault::no_such_vcpu:
            return text<Line>("there is no "sv, at);
        case ChainFault::io_behind:
            return text<Line>(at, " is no loop: an edge can only be the beginning"sv);
        case ChainFault::no_period:
            return text<Line>(at, " does not own its core: no length of a pass bounds its work"sv);
        case ChainFault::never_in_time:
            return text<Line>(at, " has no response time that admission knows"sv);
    }
    if (chain.limits.age > Nanoseconds{0} && !bound.has_age)
        return "what an edge brought is fresh until the next edge: it has reactsWithin() alone"sv;
    return {};
}

Line fault_of(const Chain& chain) {
    if (chain.wrong) return std::string_view{chain.wrong};
    if (chain.source == Chain::Source::none) return "it does not say what it begins with: from()"sv;
    if (chain.stages.empty()) return "no loop is in it: through()"sv;
    if (chain.to.empty()) return "it does not say what it leads to: to()"sv;
    return {};
}

/// "reaction 23 ms > 20 ms", "age 5 ms of 8 ms", "age 5 ms".
Line against(std::string_view what, Nanoseconds bound, Nanoseconds limit) {
    Line out = text<Line>(what, ' ', bound);
    if (limit > Nanoseconds{0}) write(out, bound > limit ? " > "sv : " of "sv, limit);
    return out;
}

/// Calls `piece` with the name of each part, from the event to the output.
void each_part(const Chain& chain, auto piece) {
    piece(chain.from);
    for (const sched::ChainStage& stage : chain.stages)
        piece(text<Line>(stage.queued ? " > ring > "sv : " > "sv, stage_name(stage.vcpu)));
    piece(text<Line>(" > "sv, chain.to));
}

/// Broken before column 80.
void write_way(Explanation& out, const Chain& chain) {
    out.append("    "sv);
    std::size_t column = 4;
    each_part(chain, [&](std::string_view words) {
        if (column + words.size() > 78) {
            out.append("\n      "sv);
            column = 6;
        }
        out.append(words);
        column += words.size();
    });
    out.push_back('\n');
}

/// The steps from release to release, and what the last stage needs: who takes the time.
void write_steps(Explanation& out, const Chain& chain,
                 const FixedVector<Nanoseconds, sched::kChainStageLimit>& steps,
                 const sched::ChainBound& bound, Nanoseconds sum) {
    for (std::size_t k = 0; k < steps.size(); ++k) {
        if (steps[k] == Nanoseconds{0}) continue;
        const Line to = stage_name(chain.stages[k].vcpu);
        sched::write_amount(out,
                            k == 0
                                ? text<Line>("until "sv, to, " begins"sv)
                                : text<Line>("from "sv, stage_name(chain.stages[k - 1].vcpu), " to "sv, to),
                            steps[k]);
    }
    sched::write_amount(out, text<Line>("until "sv, stage_name(chain.stages.back().vcpu), " ends"sv),
                        bound.last);
    sched::write_amount(out, "together"sv, sum);
}

}  // namespace

ChainVerdict judge(const Chain& chain, const sched::MulticoreAdmission& admission) {
    ChainVerdict verdict{.chain = chain, .bound = {}, .wrong = fault_of(chain)};
    if (!verdict.wrong.empty()) return verdict;
    verdict.bound = sched::bound_of(admission, chain.stages);
    verdict.wrong = fault_of(chain, verdict.bound);
    return verdict;
}

FixedString<240> way_of(const Chain& chain) {
    FixedString<240> way;
    each_part(chain, [&](std::string_view words) { way.append(words); });
    return way;
}

FixedString<200> in_short(const ChainVerdict& verdict) {
    using Short = FixedString<200>;
    const Chain& chain = verdict.chain;
    Short out = text<Short>(chain.name, ": "sv);
    if (!verdict.wrong.empty()) return write(out, verdict.wrong);
    const sched::ChainBound& bound = verdict.bound;
    const bool late = chain.limits.reaction > Nanoseconds{0} && bound.reaction > chain.limits.reaction;
    const bool old = chain.limits.age > Nanoseconds{0} && bound.age > chain.limits.age;
    if (late || !old) write(out, against("reaction"sv, bound.reaction, chain.limits.reaction));
    if ((old || !late) && bound.has_age)
        write(out, old && !late ? ""sv : ", "sv, against("age"sv, bound.age, chain.limits.age));
    return out;
}

void explain(Explanation& out, const ChainVerdict& verdict) {
    const Chain& chain = verdict.chain;
    const sched::ChainBound& bound = verdict.bound;
    write(out, "chain "sv, chain.name, verdict.holds() ? ""sv : " is refused"sv, ":\n"sv);
    write_way(out, chain);
    if (!verdict.wrong.empty()) {
        write(out, "  "sv, verdict.wrong, '\n');
        return;
    }
    write(out, "  "sv, against("reaction"sv, bound.reaction, chain.limits.reaction));
    const bool late = chain.limits.reaction > Nanoseconds{0} && bound.reaction > chain.limits.reaction;
    if (late) {
        out.append(", at worst:\n"sv);
        write_steps(out, chain, bound.reaction_steps, bound, bound.reaction);
    }
    if (!bound.has_age) {
        if (!late) out.push_back('\n');
        return;
    }
    write(out, late ? "  "sv : ", "sv, against("age"sv, bound.age, chain.limits.age));
    if (chain.limits.age > Nanoseconds{0} && bound.age > chain.limits.age) {
        out.append(", at worst:\n"sv);
        write_steps(out, chain, bound.age_steps, bound, bound.age);
    } else {
        out.push_back('\n');
    }
}

}  // namespace qduino::runtime
