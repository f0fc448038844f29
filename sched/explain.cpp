#include "sched/explain.h"

#include <algorithm>
#include <array>

namespace qduino::sched {
namespace {

/// Builds lines in bounded memory.
class Writer {
  public:
    Writer& operator<<(std::string_view text) { return text_.append(text), *this; }
    Writer& operator<<(std::int64_t number) {
        if (number < 0) text_.push_back('-');
        std::uint64_t rest =
            number < 0 ? 0 - static_cast<std::uint64_t>(number) : static_cast<std::uint64_t>(number);
        char digits[20];
        std::size_t count = 0;
        do digits[count++] = static_cast<char>('0' + rest % 10);
        while ((rest /= 10) != 0);
        while (count > 0) text_.push_back(digits[--count]);
        return *this;
    }
    Writer& operator<<(Nanoseconds duration) { return *this << duration_text(duration).view(); }

    /// Blanks up to `column` of the present line; at least one.
    Writer& to_column(std::size_t column) {
        const std::size_t at = text_.size() - line_start_;
        for (std::size_t i = at; i < std::max(column, at + 1); ++i) text_.push_back(' ');
        return *this;
    }
    /// `text` so that it ends at `column`.
    Writer& right(std::string_view text, std::size_t column) {
        const std::size_t at = text_.size() - line_start_;
        if (at + text.size() < column) to_column(column - text.size());
        return *this << text;
    }
    void line_end() {
        text_.push_back('\n');
        line_start_ = text_.size();
    }
    [[nodiscard]] const Explanation& text() const { return text_; }

  private:
    Explanation text_;
    std::size_t line_start_ = 0;
};

/// Millionths as a ratio with four decimals, to the nearest.
void write_ratio(Writer& out, std::int64_t ppm) {
    const std::int64_t parts = (ppm + 50) / 100;
    out << parts / 10'000 << ".";
    for (std::int64_t unit = 1000; unit > 0; unit /= 10) out << parts / unit % 10;
}

void write_name(Writer& out, VcpuId id, bool io) { out << (io ? "I/O VCPU " : "loop ") << std::int64_t{id}; }

void write_parameters(Writer& out, const VcpuParameters& parameters) {
    out << "(" << parameters.budget << " in " << parameters.period << ")";
}

void write_share(Writer& out, const Share& share) {
    out << "    ";
    switch (share.kind) {
        case Share::Kind::own:
            write_name(out, share.id, false);
            out << " itself";
            break;
        case Share::Kind::main:
            write_name(out, share.id, false);
            break;
        case Share::Kind::io:
            write_name(out, share.id, true);
            break;
        case Share::Kind::platform:
            out << share.name.view();
            break;
        case Share::Kind::overhead:
            out << "release and enforcement";
            break;
    }
    out.right(duration_text(share.amount), 48).line_end();
}

void write_shares(Writer& out, const Refusal& refusal) {
    if (refusal.shares.empty()) return;
    Nanoseconds sum{0};
    out << "  who takes its " << refusal.response.period << ", at worst:";
    out.line_end();
    for (const Share& share : refusal.shares) {
        sum += share.amount;
        write_share(out, share);
    }
    out << "    together";
    out.right(duration_text(sum), 48).line_end();
}

void write_remedy(Writer& out, const Refusal& refusal) {
    const Remedy& remedy = refusal.remedy;
    if (!remedy.budget_less_by && !remedy.period_more_by && !remedy.other_core) {
        out << "  no change to this one alone would be admitted";
        return out.line_end();
    }
    out << "  smallest change that would be admitted, each alone:";
    out.line_end();
    if (remedy.budget_less_by) {
        out << "    budget " << refusal.parameters.budget - *remedy.budget_less_by << " ("
            << *remedy.budget_less_by << " less)";
        out.line_end();
    }
    if (remedy.period_more_by) {
        out << "    period " << refusal.parameters.period + *remedy.period_more_by << " ("
            << *remedy.period_more_by << " more)";
        out.line_end();
    }
    if (remedy.other_core) {
        out << "    core " << std::int64_t{*remedy.other_core};
        out.line_end();
    }
}

void write_response(Writer& out, const LoopResponse& loop) {
    if (loop.response > kResponseLimit * loop.period) {
        out << "never gets its budget in time: R > " << kResponseLimit * loop.period;
    } else {
        out << "R = " << loop.response;
    }
    out << (loop.meets ? " <= T = " : " > T = ") << loop.period;
}

/// Why, in one line, after "X (C in T) is refused on core k:".
void write_reason(Writer& out, const Refusal& refusal) {
    switch (refusal.because) {
        case RefusedBecause::none:
            break;
        case RefusedBecause::bad_parameters:
            out << "needs 0 < budget <= period <= 24 h";
            break;
        case RefusedBecause::duplicate_id:
            out << "another VCPU has this id";
            break;
        case RefusedBecause::core_owned:
            write_name(out, refusal.other, false);
            out << " owns that core (its budget is its period)";
            break;
        case RefusedBecause::no_such_core:
            out << "this machine has no such core";
            break;
        case RefusedBecause::too_many:
            out << "the core takes no more of its kind";
            break;
        case RefusedBecause::io_overload:
            out << "the I/O VCPUs ask for more than the core";
            break;
        case RefusedBecause::completion_time:
        case RefusedBecause::no_core_fits:
            if (refusal.response.id == 0) {
                out << "no core takes it";
                break;
            }
            if (refusal.response.id != refusal.id || refusal.io) {
                write_name(out, refusal.response.id, false);
                out << " would miss its period, ";
            }
            write_response(out, refusal.response);
            break;
    }
}

void write_refusal(Writer& out, const Refusal& refusal, int core) {
    if (refusal.because == RefusedBecause::none) return;
    write_name(out, refusal.id, refusal.io);
    out << " ";
    write_parameters(out, refusal.parameters);
    out << " is refused";
    if (refusal.because == RefusedBecause::no_core_fits) {
        out << " by every core";
        if (core != kAnyCore) out << "; nearest is core " << std::int64_t{core};
    } else if (core != kAnyCore) {
        out << " on core " << std::int64_t{core};
    }
    out << ":";
    out.line_end();
    out << "  ";
    write_reason(out, refusal);
    out.line_end();
    write_shares(out, refusal);
    write_remedy(out, refusal);
}

void write_core(Writer& out, const Admission& admission) {
    if (admission.loops.empty() && admission.admitted) return;
    out << "core " << std::int64_t{admission.core} << ": " << (admission.admitted ? "admitted" : "refused");
    if (admission.by == AdmittedBy::owned && !admission.loops.empty()) {
        // An owned core needs no test, and none was made: with overheads, the bound would not hold
        // of a whole core.
        out << ", owned by ";
        write_name(out, admission.loops[0].id, false);
        out << ": it is alone there and never throttled";
    } else if (!admission.loops.empty()) {
        out << ", utilisation ";
        write_ratio(out, admission.utilisation_ppm);
        out << (admission.by == AdmittedBy::completion_time ? " > " : " <= ") << "bound ";
        write_ratio(out, admission.bound_ppm);
        if (admission.by == AdmittedBy::completion_time) out << ": completion time decides";
    }
    out.line_end();
    for (const LoopResponse& loop : admission.loops) {
        out << "  ";
        write_name(out, loop.id, false);
        out.to_column(11);
        write_response(out, loop);
        out.line_end();
    }
}

}  // namespace

FixedString<32> duration_text(Nanoseconds duration) {
    struct Unit {
        std::int64_t ns;
        std::string_view name;
    };
    static constexpr std::array<Unit, 4> kUnits{
        {{1'000'000'000, " s"}, {1'000'000, " ms"}, {1000, " us"}, {1, " ns"}}};
    const std::int64_t ns = duration.count();
    FixedString<32> text;
    for (const Unit& unit : kUnits) {
        // Three decimals of this unit must express the duration exactly. Below one unit, the next
        // smaller unit reads better.
        const std::int64_t grain = unit.ns >= 1000 ? unit.ns / 1000 : 1;
        const bool below = (ns < 0 ? -ns : ns) < unit.ns;
        if (unit.ns > 1 && (below || ns % grain != 0)) continue;
        Writer number;
        number << ns / unit.ns;
        std::int64_t rest = (ns < 0 ? -ns : ns) % unit.ns / grain;
        if (rest != 0) {
            number << ".";
            for (std::int64_t digit = 100; rest != 0; rest %= digit, digit /= 10) number << rest / digit;
        }
        return text.append(number.text()).append(unit.name);
    }
    return text;
}

Explanation explain(const Admission& admission) {
    Writer out;
    write_core(out, admission);
    write_refusal(out, admission.refusal, admission.core);
    return out.text();
}

Explanation explain(const Refusal& refusal, int core) {
    Writer out;
    write_refusal(out, refusal, core);
    return out.text();
}

Explanation explain(const MachineAdmission& machine) {
    Writer out;
    for (const Admission& core : machine.cores) {
        if (!core.loops.empty()) write_core(out, core);
    }
    write_refusal(out, machine.refusal, machine.refused_core);
    return out.text();
}

}  // namespace qduino::sched
