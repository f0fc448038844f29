#include "sched/explain.h"

#include <algorithm>

#include "base/text.h"
#include "base/words.h"

namespace qduino::sched {
namespace {

// Literals know their lengths (sv): sched/ needs no strlen().
using namespace std::string_view_literals;
using Phrase = FixedString<64>;

/// Blanks up to `column` of the last line; at least one.
void to_column(Explanation& out, std::size_t column) {
    const std::size_t line_start = out.view().rfind('\n') + 1;  // 0 where there is no line yet
    do out.push_back(' ');
    while (out.size() < line_start + column);
}

/// Millionths as a ratio with four decimals, to the nearest.
Phrase ratio(std::int64_t ppm) {
    const std::int64_t parts = (ppm + 50) / 100;
    // The first digit is there to keep the zeros behind it.
    const auto digits = text<Phrase>(10'000 + parts % 10'000);
    return text<Phrase>(parts / 10'000, '.', std::string_view{digits.view().data() + 1, 4});
}

Phrase name_of(VcpuId id, VcpuKind kind = VcpuKind::main) {
    return text<Phrase>(kind == VcpuKind::io ? "I/O VCPU "sv : "loop "sv, id);
}

Phrase name_of(const Share& share) {
    switch (share.kind) {
        case Share::Kind::own:
            return text<Phrase>(name_of(share.id), " itself"sv);
        case Share::Kind::sleep:
            return "its sleep"sv;
        case Share::Kind::blocking:
            return "locks of lower loops (heldBy)"sv;
        case Share::Kind::remote:
            return "locks of other cores (heldBy)"sv;
        case Share::Kind::main:
            return name_of(share.id);
        case Share::Kind::io:
            return name_of(share.id, VcpuKind::io);
        case Share::Kind::platform:
            return share.name.view();
        case Share::Kind::overhead:
            break;
    }
    return "release and enforcement"sv;
}

void write_shares(Explanation& out, const Refusal& refusal) {
    if (refusal.shares.empty()) return;
    Nanoseconds sum{0};
    write(out, "  who takes its "sv, refusal.response.period, ", at worst:\n"sv);
    for (const Share& share : refusal.shares) {
        sum += share.amount;
        write_amount(out, name_of(share), share.amount);
    }
    write_amount(out, "together"sv, sum);
}

/// A bound on what comes in bursts is no count of what came, and a person would ask where it is
/// from.
void write_bursts(Explanation& out, const Refusal& refusal) {
    for (const Share& share : refusal.shares) {
        if (share.at_once <= Nanoseconds{0}) continue;
        write(out, "  ("sv, share.name, ": counted as up to "sv, share.at_once, " at once, and "sv,
              ratio(share.long_run_ppm), " of the core)\n"sv);
    }
}

/// Waits for other cores have a cure of their own.
void write_sharers(Explanation& out, const Refusal& refusal) {
    const bool waits = std::ranges::any_of(
        refusal.shares, [](const Share& share) { return share.kind == Share::Kind::remote; });
    if (!waits || refusal.sharers.empty()) return;
    write(out, "  "sv, name_of(refusal.response.id), " waits for locks that it shares with "sv);
    for (std::size_t i = 0; i < refusal.sharers.size(); ++i) {
        const bool last = i + 1 == refusal.sharers.size();
        write(out, i == 0 ? ""sv : last ? " and "sv : ", "sv, name_of(refusal.sharers[i]));
    }
    write(out,
          ",\n  some on other cores. It would wait less with all of them on one core, or with\n"
          "  shorter locks (heldBy), and not at all with a RingBuffer or a Channel.\n"sv);
}

void write_remedy(Explanation& out, const Refusal& refusal) {
    const auto& [less, more, core] = refusal.remedy;
    const Vcpu& vcpu = refusal.vcpu;
    if (!less && !more && !core) {
        write(out, "  no change to this one alone would be admitted\n"sv);
        return;
    }
    write(out, "  smallest change that would be admitted, each alone:\n"sv);
    if (less) write(out, "    budget "sv, vcpu.budget - *less, " ("sv, *less, " less)\n"sv);
    if (more) write(out, "    period "sv, vcpu.period + *more, " ("sv, *more, " more)\n"sv);
    if (core) write(out, "    core "sv, *core, '\n');
}

/// R for people: from a millisecond on to the microsecond, and up, for it is a bound.
Nanoseconds readable(Nanoseconds response) {
    if (response < 1ms) return response;
    return (response + 1us - Nanoseconds{1}) / 1us * Nanoseconds{1000};
}

void write_response(Explanation& out, const LoopResponse& loop) {
    if (loop.response > kResponseLimit * loop.period) {
        write(out, "never gets its budget in time: R > "sv, kResponseLimit * loop.period);
    } else {
        write(out, loop.meets() ? "R "sv : "R = "sv, readable(loop.response));
    }
    write(out, loop.meets() ? " of T "sv : " > T = "sv, loop.period);
}

constexpr Words<RefusedBecause::none, RefusedBecause::no_core_fits> kReasons{
    "",
    "needs 0 < budget <= period <= 24 h",
    "another VCPU has this id",
    " owns that core (its budget is its period)",
    "this computer has no such core",
    "the core takes no more of its kind",
    "the I/O VCPUs ask for more than the core",
    "",
    "",
    "",
};

/// Why, in one line, after "X (C in T) is refused on core k:".
void write_reason(Explanation& out, const Refusal& refusal) {
    if (refusal.because == RefusedBecause::core_owned) write(out, name_of(refusal.other));
    write(out, kReasons(refusal.because));
    const bool analysed = is_late(refusal.because) || refusal.because == RefusedBecause::no_core_fits;
    if (!analysed) return;
    const LoopResponse& late = refusal.response;
    if (late.id == 0) {
        write(out, "no core takes it"sv);
        return;
    }
    if (refusal.late == VcpuKind::io)
        write(out, name_of(late.id, refusal.late), " would be served late for a loop of its core:\n  "sv);
    else if (late.id != refusal.vcpu.id)
        write(out, name_of(late.id), " would miss its period, "sv);
    write_response(out, late);
}

void write_refusal(Explanation& out, const Refusal& refusal, int core) {
    if (refusal.because == RefusedBecause::none) return;
    const bool everywhere = refusal.because == RefusedBecause::no_core_fits;
    const Vcpu& vcpu = refusal.vcpu;
    write(out, name_of(vcpu.id, vcpu.kind), " ("sv, vcpu.budget, " in "sv, vcpu.period, ") is refused"sv,
          everywhere ? " by every core"sv : ""sv);
    if (core != kAnyCore) write(out, everywhere ? "; nearest is core "sv : " on core "sv, core);
    write(out, ":\n  "sv);
    write_reason(out, refusal);
    write(out, '\n');
    write_shares(out, refusal);
    write_bursts(out, refusal);
    write_sharers(out, refusal);
    write_remedy(out, refusal);
}

void write_core(Explanation& out, const Admission& admission) {
    if (admission.loops.empty() && admission.admitted) return;
    write(out, "core "sv, admission.core, ": "sv, admission.admitted ? "admitted"sv : "refused"sv);
    if (admission.by == AdmittedBy::owned && !admission.loops.empty()) {
        // An owned core needs no test, and none was made: with overheads, the bound would not hold
        // of a whole core.
        write(out, ", owned by "sv, name_of(admission.loops[0].id),
              ": it is alone there and never throttled"sv);
    } else if (!admission.loops.empty()) {
        const bool by_time = admission.by == AdmittedBy::completion_time;
        write(out, ", utilisation "sv, ratio(admission.utilisation_ppm));
        if (by_time)
            write(out, ": even at worst, each ends in time (R <= T)"sv);
        else
            write(out, " <= bound "sv, ratio(admission.bound_ppm));
    }
    write(out, '\n');
    for (const LoopResponse& loop : admission.loops) {
        write(out, "  "sv, name_of(loop.id));
        to_column(out, 11);
        write_response(out, loop);
        write(out, '\n');
    }
}

}  // namespace

/// `amount` ends at column 48.
void write_amount(Explanation& out, std::string_view taker, Nanoseconds amount) {
    constexpr std::size_t kColumn = 48;
    const auto number = text<Phrase>(amount);
    write(out, "    "sv, taker);
    to_column(out, kColumn - number.size());
    write(out, number, '\n');
}

Explanation explain(const Admission& admission) {
    Explanation out;
    write_core(out, admission);
    write_refusal(out, admission.refusal, admission.core);
    return out;
}

Explanation explain(const Refusal& refusal, int core) {
    Explanation out;
    write_refusal(out, refusal, core);
    return out;
}

Explanation explain(const MulticoreAdmission& computer) {
    Explanation out;
    for (const Admission& core : computer.cores) {
        if (!core.loops.empty()) write_core(out, core);
    }
    write_refusal(out, computer.refusal, computer.refused_core);
    return out;
}

}  // namespace qduino::sched
