#include "runtime/plan.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "sched/admission.h"
#include "sched/completion_time.h"
#include "sched/exact.h"
#include "sched/remote_blocking.h"

namespace qduino::runtime {

namespace {

using sched::RefusedBecause;

std::string place_of(const LoopDeclaration& declaration) {
    return text<std::string>(std::string_view{declaration.file}, ':', declaration.line);
}

/// The numbers of a declaration, before they enter a proof. Budget, period and core have refusals
/// of their own, which name the place as well (admission.h).
Result<void> check_numbers(const LoopDeclaration& loop) {
    constexpr int kMostSleeps = 1'000'000;
    const auto bad = [&](auto... words) {
        return make_error(ErrorCode::invalid_argument, place_of(loop), ": loop ", loop.id, words...);
    };
    if (loop.core < kAnyCore) return bad(" names core ", loop.core, "; the first is 0");
    if (loop.suspension < Nanoseconds{0} || loop.suspension > loop.period)
        return bad(" sleeps ", loop.suspension, ", which is not within 0 and its period, ", loop.period);
    if (loop.sleeps < 1 || loop.sleeps > kMostSleeps)
        return bad(" sleeps ", loop.sleeps, " times; 1 to ", kMostSleeps, " is possible");
    if (loop.says_sleeps && loop.suspension == Nanoseconds{0})
        return bad(" sleeps ", loop.sleeps, " times, for no time at all");
    return {};
}

Result<void> check_declarations(const SketchTable& table) {
    if (table.dropped > 0) {
        return make_error(ErrorCode::out_of_range, "the sketch declares ",
                          table.loops.size() + static_cast<std::size_t>(table.dropped),
                          " loops; 32 is the most");
    }
    if (table.loops.empty()) return make_error(ErrorCode::invalid_argument, "the sketch declares no loop");
    for (const LoopDeclaration& loop : table.loops) {
        if (loop.id < 1 || loop.id > board::kMaxLoop || !loop.body) {
            return make_error(ErrorCode::invalid_argument, place_of(loop),
                              ": a loop has an id of 1…32 and a body");
        }
        QDUINO_TRY(check_numbers(loop));
        for (const LoopDeclaration& other : table.loops) {
            if (&other == &loop || other.id != loop.id) continue;
            return make_error(ErrorCode::already_exists, place_of(other), ": loop ", loop.id,
                              " was declared before, at ", place_of(loop));
        }
    }
    return {};
}

void set_parameters(sched::Vcpu& vcpu, sched::VcpuParameters parameters) {
    vcpu.budget = parameters.budget;
    vcpu.period = parameters.period;
}

/// U of `a` > U of `b`.
bool has_more(sched::VcpuParameters a, sched::VcpuParameters b) {
    using sched::Int128;
    return Int128{a.budget.count()} * b.period.count() > Int128{b.budget.count()} * a.period.count();
}

bool bears(const sched::PlatformOverheads& overheads, const sched::PlatformInterferer& interferer) {
    return std::ranges::any_of(overheads.interferers,
                               [&](const sched::PlatformInterferer& each) { return each == interferer; });
}

Nanoseconds longest_period_of(const sched::CoreLoad& load) {
    Nanoseconds longest{};
    for (const sched::Vcpu& loop : load.mains) longest = std::max(longest, loop.period);
    return longest;
}

/// The shortest period of a loop on the core: a bottom half works on behalf of that loop.
Nanoseconds client_period(std::span<const sched::Vcpu> requests, const sched::MulticoreAdmission& admission,
                          int core) {
    Nanoseconds shortest{};
    for (const sched::Vcpu& loop : requests) {
        if (loop.is_io() || admission.core_of(loop.id) != core) continue;
        if (shortest == Nanoseconds{0} || loop.period < shortest) shortest = loop.period;
    }
    return shortest;
}

/// Why a change that came while the loops run is not made.
Error refused_change(const char* change, int core, const sched::Refusal& refusal) {
    if (sched::is_late(refusal.because)) {
        return make_error(ErrorCode::out_of_range, change, ", ", vcpu_name(refusal.vcpu.id), " on core ",
                          core, " would need ", refusal.response.response, " of its ",
                          refusal.response.period);
    }
    return make_error(ErrorCode::out_of_range, change, ", core ", core,
                      " would have more to do than it has time");
}

}  // namespace

std::string vcpu_name(board::VcpuId id) {
    return text<std::string>(id <= board::kMaxLoop ? "loop " : "io ", id);
}

Plan::Plan(bool enforce) : enforce_(enforce), admission_(std::make_unique<sched::MulticoreAdmission>()) {}

Result<void> Plan::add_loops(const SketchTable& table) {
    if (const Result<void> checked = check_declarations(table); !checked) {
        explanation_ = checked.error().message.view();
        return checked;
    }
    const auto fresh = table.loops.begin() + static_cast<std::ptrdiff_t>(declarations_.size());
    requests_.insert(requests_.end(), fresh, table.loops.end());
    declarations_.insert(declarations_.end(), fresh, table.loops.end());
    return {};
}

Result<board::VcpuId> Plan::add_io(Nanoseconds budget, Nanoseconds period, int core) {
    const auto taken = [&](board::VcpuId id) {
        return std::ranges::count(requests_, id, &sched::Vcpu::id) > 0;
    };
    board::VcpuId id = board::kFirstIoVcpu;
    while (id < board::kVcpuLimit && taken(id)) ++id;
    if (id == board::kVcpuLimit) return make_error(ErrorCode::unavailable, "all 31 I/O VCPUs are in use");
    requests_.push_back({id, budget, period, core, board::VcpuKind::io});
    return id;
}

void Plan::redeclare_io(board::VcpuId id, sched::VcpuParameters parameters, int core) {
    sched::Vcpu& io = *std::ranges::find(requests_, id, &sched::Vcpu::id);
    set_parameters(io, parameters);
    io.core = core;
}

void Plan::remove_io(board::VcpuId id) {
    std::erase_if(requests_, [id](const sched::Vcpu& vcpu) { return vcpu.id == id; });
}

void Plan::keep_off(board::VcpuId id, std::uint64_t cores) {
    std::ranges::find(requests_, id, &sched::Vcpu::id)->kept_off = cores;
}

bool Plan::give_core(int core) {
    const auto named = std::ranges::find(requests_, core, &sched::Vcpu::core);
    if (named == requests_.end() || named->is_io() ||
        std::ranges::count(requests_, core, &sched::Vcpu::core) > 1)
        return false;
    named->budget = named->period;
    return true;
}

void Plan::add_section(const sched::CriticalSection& section) {
    const bool fits = section.lock < sched::kLockLimit && sections_.try_push_back(section);
    too_many_sections_ = too_many_sections_ || !fits;
}

void Plan::add_chain(const Chain& chain) {
    too_many_chains_ =
        !declared_chains_.try_push_back({.chain = chain, .bound = {}, .wrong = {}}) || too_many_chains_;
}

/// As the loops stand.
Result<void> Plan::judge_chains(const char* change) {
    chains_.clear();
    for (const ChainVerdict& each : declared_chains_)
        chains_.push_back(runtime::judge(each.chain, *admission_));
    const auto* const broken = std::ranges::find_if_not(chains_, &ChainVerdict::holds);
    if (broken == chains_.end() || !enforce_) return {};
    return make_error(broken->wrong.empty() ? ErrorCode::out_of_range : ErrorCode::invalid_argument, change,
                      *change == '\0' ? "chain " : ", chain ", in_short(*broken));
}

/// With what would help one that is refused.
void Plan::explain_chain(sched::Explanation& out, const ChainVerdict& chain) const {
    runtime::explain(out, chain);
    if (chain.holds() || !chain.wrong.empty()) return;
    bool found = false;
    for (const sched::Vcpu& loop : admission_->placed) {
        const Nanoseconds longest = longest_period(chain, loop.id);
        if (longest == Nanoseconds{0}) continue;
        if (!found) write(out, "  longest period with which it would hold, each alone:\n");
        found = true;
        sched::write_amount(out, vcpu_name(loop.id), longest);
    }
    if (!found) write(out, "  no period of one loop alone would make it hold\n");
}

Nanoseconds Plan::longest_period(const ChainVerdict& chain, board::VcpuId id) const {
    const auto names = [id](const sched::ChainStage& stage) { return stage.vcpu == id; };
    if (!chain.wrong.empty() || std::ranges::none_of(chain.chain.stages, names)) return Nanoseconds{0};
    const auto scratch = std::make_unique<sched::MulticoreAdmission>(*admission_);
    return sched::longest_period(*scratch, chain.chain.stages, chain.chain.limits, id);
}

void Plan::add_edges(board::VcpuId id, board::EdgeCost cost) {
    if (cost.each <= Nanoseconds{0}) return;
    sched::Vcpu& io = *std::ranges::find(requests_, id, &sched::Vcpu::id);
    io.edge_cost += cost.each;
    io.edge_interval = cost.interval;
    if (cost.interval > Nanoseconds{0}) return;
    refuse(
        text<std::string>("each edge of a pin with a handler takes ", cost.each,
                          " above every loop (edge_top_half), and nothing says how often edges come: "
                          "say the least time between two of a pin in the board file, [sim] edge_interval"));
}

void Plan::refuse(const std::string& reason) {
    if (refused_.empty()) refused_ = reason;
}

/// A handler's lock stays on its core, and no second handler is connected with it: the analysis
/// (blocking.h) has no more.
Result<void> Plan::refuse_handlers_apart() const {
    std::array<sched::LockSet, std::numeric_limits<board::VcpuId>::max() + 1> held{};
    for (const sched::CriticalSection& each : sections_) {
        if (!each.assumed) held[each.loop] |= sched::LockSet{1} << each.lock;
    }
    for (const sched::CriticalSection& of_handler : sections_) {
        if (of_handler.loop < board::kFirstIoVcpu || of_handler.assumed) continue;
        const sched::LockSet locks = sched::chained_with(
            sched::LockSet{1} << of_handler.lock, [&](auto visit) { std::ranges::for_each(held, visit); });
        for (const sched::Vcpu& other : requests_) {
            if (other.id == of_handler.loop || (held[other.id] & locks) == 0) continue;
            if (!other.is_io() && admission_->core_of(other.id) == admission_->core_of(of_handler.loop))
                continue;
            return make_error(ErrorCode::out_of_range, "a handler on I/O VCPU ", of_handler.loop,
                              " shares a lock with ", vcpu_name(other.id), ", which is ",
                              other.is_io() ? "a handler, too" : "on another core",
                              ": how long they wait is not known. Give the bytes over in a RingBuffer or a "
                              "Channel instead");
        }
    }
    return {};
}

/// Where something that the analysis needs was not said.
Result<void> Plan::refuse_unknown() const {
    QDUINO_TRY(refuse_handlers_apart());
    for (const sched::CoreLoad& load : admission_->loads) {
        const sched::CompletionTime analysis{load};
        for (const LoopDeclaration& loop : declarations_) {
            if (loop.suspension == Nanoseconds{0} || loop.says_sleeps) continue;
            if (!analysis.blocks_after_each_sleep(loop.id)) continue;
            return make_error(
                ErrorCode::invalid_argument, place_of(loop), ": loop ", loop.id, " sleeps ", loop.suspension,
                ", and may wait for a lock, or wake late, after each piece of that sleep: say in "
                "how many pieces it sleeps, as the sixth argument of loop()");
        }
    }
    return {};
}

/// What the servers get beside the budgets, for as long as the loops run.
void Plan::give_allowances() {
    for (sched::CoreLoad& load : admission_->loads) {
        for (sched::Vcpu& loop : load.mains) {
            loop.allowance = load.allowance_of(loop);
            std::ranges::find(requests_, loop.id, &sched::Vcpu::id)->allowance = loop.allowance;
        }
    }
}

Result<void> Plan::admit(const std::vector<sched::PlatformOverheads>& overheads) {
    if (too_many_chains_) return make_error(ErrorCode::out_of_range, "more than ", kChainLimit, " chains");
    if (too_many_sections_)
        refuse(text<std::string>(
            "more than ", sections_.size(),
            " critical sections: use fewer Mutexes, or say which loops hold them (heldBy)"));
    if (!refused_.empty() && enforce_) {
        explanation_ = std::string_view{refused_};
        return make_error(ErrorCode::out_of_range, refused_);
    }
    sched::admit_all(requests_, overheads, sections_, *admission_);
    before_.resize(admission_->loads.size());
    asked_.resize(admission_->loads.size());
    if (admission_->admitted) make_deferrable();
    give_allowances();
    if (Result<void> known; admission_->admitted && !(known = refuse_unknown()).ok()) {
        admission_->admitted = !enforce_;
        explanation_ = known.error().message.view();
        return enforce_ ? known : Result<void>{};
    }
    explanation_ = sched::explain(*admission_);
    if (!admission_->admitted) return enforce_ ? refusal_in_short() : Result<void>{};
    const Result<void> kept = judge_chains("");
    for (const ChainVerdict& chain : chains_)
        if (!chain.holds()) explain_chain(explanation_, chain);
    return kept;
}

/// The refusal in one line.
Result<void> Plan::refusal_in_short() const {
    const sched::Refusal& refusal = admission_->refusal;
    const auto declared = std::ranges::find(declarations_, refusal.vcpu.id, &LoopDeclaration::id);
    const ErrorCode code = refusal.because == RefusedBecause::bad_parameters ? ErrorCode::invalid_argument
                           : refusal.because == RefusedBecause::no_such_core ? ErrorCode::not_found
                                                                             : ErrorCode::out_of_range;
    // Which loop, and by how much. The explanation has the rest.
    const sched::Explanation whole = sched::explain(refusal, admission_->refused_core);
    const std::string_view brief = whole.view().substr(0, whole.view().find("\n  who takes"));
    return make_error(code, declared == declarations_.end() ? "" : place_of(*declared) + ": ", brief);
}

/// After a change of `load`. Where loops wait for each other's cores, it changes those, too.
bool Plan::fits(const sched::CoreLoad& load, bool with_promise_below) {
    if (with_promise_below && !sched::keeps_promise_below(load)) return false;
    const bool alone = load.waits.empty();
    return alone ? sched::is_admissible(load) : sched::are_admissible(admission_->loads);
}

/// A loop that sleeps within a release, and did not say so, makes its next release late. Where the
/// others on its core can bear it, its budget comes back at once instead (deferrable_server.h);
/// the lowest loops first, whose jitter delays the fewest. A deferrable server counts twice for
/// those below it: what other programs were promised below all loops (a print service) keeps its
/// place, if it has one at all.
void Plan::make_deferrable() {
    for (sched::CoreLoad& load : admission_->loads) {
        if (load.mains.empty() || owner_of(load.core) != board::kNoVcpu) continue;
        std::vector<sched::Vcpu*> by_rank;
        for (sched::Vcpu& loop : load.mains) by_rank.push_back(&loop);
        std::ranges::sort(by_rank, [](const auto* a, const auto* b) { return sched::ranks_above(*b, *a); });
        const bool with_promise_below = sched::keeps_promise_below(load);
        for (sched::Vcpu* loop : by_rank) {
            const bool before = std::exchange(loop->deferrable, true);
            loop->deferrable = before || fits(load, with_promise_below);
        }
        for (const sched::Vcpu* loop : by_rank)
            std::ranges::find(requests_, loop->id, &sched::Vcpu::id)->deferrable = loop->deferrable;
    }
    // The last trial may have been one that did not fit.
    sched::count_remote_waits(admission_->loads);
    judge_all();
}

void Plan::judge_all() {
    for (const sched::CoreLoad& load : admission_->loads)
        admission_->cores[static_cast<std::size_t>(load.core)] = sched::admit_without_remedy(load);
}

void Plan::save(std::vector<Changeable>& into) const {
    for (std::size_t i = 0; i < admission_->loads.size(); ++i)
        into[i] = {admission_->loads[i].overheads, admission_->loads[i].ios};
}

void Plan::restore(const std::vector<Changeable>& from) {
    for (std::size_t i = 0; i < admission_->loads.size(); ++i) {
        admission_->loads[i].overheads = from[i].overheads;
        admission_->loads[i].ios = from[i].ios;
    }
    sched::count_remote_waits(admission_->loads);
}

template <typename Change>
Result<void> Plan::judge(Change change, const char* name, Instant now) {
    auto& loads = admission_->loads;
    const auto refusal = [&]() -> Result<void> {
        for (const sched::CoreLoad& each : loads) {
            if (!enforce_ || (each.mains.empty() && each.ios.empty())) continue;
            for (const sched::Vcpu& loop : each.mains) {
                if (each.allowance_of(loop) <= loop.allowance) continue;
                return make_error(ErrorCode::out_of_range, name, ", loop ", loop.id, " on core ", each.core,
                                  " would pay ", each.allowance_of(loop),
                                  " of a period for interrupts, and has ", loop.allowance,
                                  " for them since it was started");
            }
            if (sched::is_admissible(each)) continue;
            return refused_change(name, each.core, sched::admit_without_remedy(each).refusal);
        }
        return {};
    };
    save(before_);
    change();
    save(asked_);
    for (sched::CoreLoad& load : loads) count_lowered(load, now);
    sched::count_remote_waits(loads);
    const bool has_chains = !declared_chains_.empty();
    Result<void> judged = refusal();
    if (judged && has_chains) {
        judge_all();
        judged = judge_chains(name);
    }
    if (judged) judged = note_routed_away(now);
    if (judged && !has_chains) judge_all();
    restore(judged ? asked_ : before_);
    if (!judged && has_chains) {
        judge_all();
        static_cast<void>(judge_chains(""));
    }
    return judged;
}

Result<void> Plan::admit_again(std::span<const sched::PlatformOverheads> overheads, const char* change,
                               Instant now) {
    if (!enforce_) return {};
    const auto apply = [&] {
        for (sched::CoreLoad& load : admission_->loads) {
            if (may_share(load.core)) load.overheads = overheads[static_cast<std::size_t>(load.core)];
        }
    };
    return judge(apply, change, now);
}

Result<void> Plan::change_io(board::VcpuId id, sched::VcpuParameters parameters, Instant now) {
    const auto request = std::ranges::find(requests_, id, &sched::Vcpu::id);
    if (request == requests_.end() || !request->is_io())
        return make_error(ErrorCode::not_found, "there is no I/O VCPU ", id);
    if (!parameters.valid()) return make_error(ErrorCode::invalid_argument, "0 < budget <= period");
    auto* const load = std::ranges::find(admission_->loads, admission_->core_of(id), &sched::CoreLoad::core);
    if (load != admission_->loads.end()) {
        const auto apply = [&] {
            set_parameters(*std::ranges::find(load->ios, id, &sched::Vcpu::id), parameters);
        };
        QDUINO_TRY(judge(apply, "with this budget", now));
        note_lowered(*load, *request, now);
        set_parameters(*std::ranges::find(admission_->placed, id, &sched::Vcpu::id), parameters);
    }
    set_parameters(*request, parameters);
    return {};
}

/// A release that began before a change has met the interrupts of then, and meets those of now.
Result<void> Plan::note_routed_away(Instant now) {
    for (std::size_t i = routed_away_.size(); i-- > 0;) {
        if (now >= routed_away_[i].until) routed_away_.erase(i);
    }
    const std::size_t noted = routed_away_.size();
    for (std::size_t i = 0; i < admission_->loads.size(); ++i) {
        const sched::CoreLoad& load = admission_->loads[i];
        for (const sched::PlatformInterferer& had : before_[i].overheads.interferers) {
            if (bears(asked_[i].overheads, had)) continue;
            if (routed_away_.try_push_back({load.core, had, now + longest_period_of(load)})) continue;
            while (routed_away_.size() > noted) routed_away_.pop_back();
            return make_error(ErrorCode::unavailable,
                              "too many changes within one release: call again later");
        }
    }
    return {};
}

/// The greatest of what it had within the last longest period.
void Plan::note_lowered(const sched::CoreLoad& load, const sched::Vcpu& before, Instant now) {
    auto* noted = std::ranges::find(lowered_, before.id, &Lowered::id);
    if (noted == lowered_.end()) {
        lowered_.push_back({.id = before.id});
        noted = &lowered_.back();
    }
    const bool had_more = now < noted->until && has_more(noted->had, before.parameters());
    *noted = {before.id, had_more ? noted->had : before.parameters(), now + longest_period_of(load)};
}

void Plan::count_lowered(sched::CoreLoad& load, Instant now) const {
    for (const Lowered& lowered : lowered_) {
        auto* const io = std::ranges::find(load.ios, lowered.id, &sched::Vcpu::id);
        if (io == load.ios.end() || now >= lowered.until || !has_more(lowered.had, io->parameters()))
            continue;
        set_parameters(*io, lowered.had);
    }
    for (const RoutedAway& away : routed_away_) {
        const bool counts = away.core == load.core && now < away.until;
        if (counts && !bears(load.overheads, away.had)) load.overheads.add(away.had);
    }
}

namespace {

/// The load of the core that the loop `id` is on, with what `change` does to that loop.
template <typename Change>
sched::CoreLoad load_with(const sched::MulticoreAdmission& admission, board::VcpuId id, Change change) {
    sched::CoreLoad load = *std::ranges::find(admission.loads, admission.core_of(id), &sched::CoreLoad::core);
    change(*std::ranges::find(load.mains, id, &sched::Vcpu::id));
    return load;
}

}  // namespace

sched::LoopResponse Plan::response_with_sleep(board::VcpuId id, Nanoseconds sleep, int pieces) const {
    const sched::CoreLoad load = load_with(*admission_, id, [&](sched::Vcpu& loop) {
        loop.suspension = sleep;
        loop.sleeps = pieces;
        loop.deferrable = true;
    });
    const sched::Admission judged = sched::admit_without_remedy(load);
    return *std::ranges::find(judged.loops, id, &sched::LoopResponse::id);
}

Nanoseconds Plan::room_for_sleep(board::VcpuId id) const {
    bool deferrable = false;
    Nanoseconds declared{};
    // The others have counted with it. A nanosecond stands for the sleep to come.
    const sched::CoreLoad load = load_with(*admission_, id, [&](sched::Vcpu& loop) {
        deferrable = loop.deferrable;
        loop.sleeps = loop.times_asleep() + 1;
        declared = loop.suspension += Nanoseconds{1};
    });
    if (!deferrable) return Nanoseconds{0};
    const sched::CompletionTime analysis{load};
    std::size_t i = 0;
    while (analysis.loop(i).id != id) ++i;
    const Nanoseconds room = analysis.room(i);
    return room > Nanoseconds{0} ? declared + room : declared - Nanoseconds{1};
}

sched::Explanation Plan::admission_table() const {
    sched::Explanation out = sched::explain(*admission_);
    for (const ChainVerdict& chain : chains_) explain_chain(out, chain);
    return out;
}

board::VcpuId Plan::owner_of(int core) const {
    const auto owns = [core](const sched::Vcpu& vcpu) {
        return !vcpu.is_io() && vcpu.core == core && vcpu.parameters().whole_core();
    };
    const auto found = std::ranges::find_if(requests_, owns);
    return found == requests_.end() ? board::kNoVcpu : found->id;
}

bool Plan::may_share(int core) const {
    const auto comes_here = [core](const sched::Vcpu& vcpu) { return vcpu.may_be_on(core); };
    return owner_of(core) == board::kNoVcpu && std::ranges::any_of(requests_, comes_here);
}

std::vector<board::VcpuSpec> Plan::specs() const {
    std::vector<board::VcpuSpec> specs;
    for (const sched::Vcpu& request : requests_) {
        board::VcpuSpec spec{request};
        // The core that it was put on; else it was refused, and runs all the same.
        spec.core = std::max({admission_->core_of(spec.id), spec.core, 0});
        spec.owns_core = owner_of(spec.core) == spec.id;
        if (spec.is_io()) spec.client_period = client_period(requests_, *admission_, spec.core);
        if (spec.is_io()) spec.overrun = sched::longest_overrun(sections_, spec.id);
        spec.requests = sched::requests_of(sections_, spec.id);
        specs.push_back(spec);
    }
    return specs;
}

}  // namespace qduino::runtime
