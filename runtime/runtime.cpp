#include "runtime/runtime.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "base/contract.h"
#include "runtime/lock_declaration.h"

namespace qduino::runtime {
namespace {

/// Before the end of a wait a loop that owns its core begins to spin.
constexpr Nanoseconds kSpinMargin = 1ms;
/// A handler that is held back looks again so often.
constexpr Nanoseconds kHeldRetry = 20us;

/// The overheads of the cores that are shared; for the others nothing is counted.
std::vector<sched::PlatformOverheads> overheads_of(board::Board& board, const Plan& plan) {
    std::vector<sched::PlatformOverheads> overheads(static_cast<std::size_t>(board.core_count()));
    for (int core = 0; core < board.core_count(); ++core) {
        if (plan.may_share(core)) overheads[static_cast<std::size_t>(core)] = board.platform_overheads(core);
    }
    return overheads;
}

/// `cores`, a bit for each core, with or without this one.
constexpr std::uint64_t with_bit(std::uint64_t cores, int core, bool there) {
    const std::uint64_t bit = std::uint64_t{1} << core;
    return there ? cores | bit : cores & ~bit;
}

/// Records once how late this release began. It is called at the end of the release, so that
/// nothing delays its first instruction.
void record_latency(Loop& loop) {
    if (loop.latency < Nanoseconds{0}) return;
    loop.statistics.release_latency_ns.record(loop.latency.count());
    loop.latency = Loop::kRecorded;
}

}  // namespace

constinit Runtime* Runtime::current_ = nullptr;

Runtime::Runtime(board::Board& board, RuntimeOptions options)
    : board_(board), options_(options), plan_(options.enforce_admission), made_at_(board.now()) {
    current_ = this;
    board::make_current(&board);
    LockDeclaration::forget_taken();
}

Runtime::~Runtime() {
    if (current_ != this) return;  // another one was made meanwhile
    current_ = nullptr;
    board::make_current(nullptr);
}

// ---- the program: host thread -------------------------------------------------------------------

Result<void> Runtime::begin(const SketchTable& table, void (*setup)()) {
    QDUINO_EXPECT(!begun_);
    QDUINO_TRY(plan_.add_loops(table));  // a table that is wrong is refused before anything is done
    board_.note_setup(true);
    if (setup) setup();
    board_.note_setup(false);
    QDUINO_TRY(plan_.add_loops(table));  // those that setup() has made
    for (const LoopDeclaration& declaration : table.loops) loop_at(declaration.id).declaration = declaration;
    LockDeclaration::note_setup(table.setup && !setup);
    add_sections(table);
    LockDeclaration::take_all();
    ChainDeclaration::take_each([this](const Chain& chain) {
        if (chain.is_declared()) add_chain(chain);
    });
    if (options_.profile || options_.measure_locks) LockDeclaration::measure_all();
    keep_handlers_off();
    overheads_ = overheads_of(board_, plan_);
    QDUINO_TRY(plan_.admit(overheads_));
    watch_chains();
    begun_ = true;
    return start_loops();
}

/// Bottom halves go where their interrupts go.
void Runtime::keep_handlers_off() {
    constexpr std::size_t kAll = board::kDeviceClassCount;
    std::uint64_t from_all = ~std::uint64_t{0};
    for (const std::uint64_t cores : away_) from_all &= cores;
    for (std::size_t device = 0; device <= kAll; ++device) {
        if (const board::VcpuId io = io_of_device_[device]; io != board::kNoVcpu)
            plan_.keep_off(io, device == kAll ? from_all : away_[device]);
    }
    for (const Handler& pin : handlers_) {
        if (pin.function) plan_.keep_off(pin.io, away_[static_cast<std::size_t>(board::DeviceClass::gpio)]);
    }
}

/// What the sketch says of its locks, checked before it enters a proof, and what is assumed.
void Runtime::add_sections(const SketchTable& table) {
    LockDeclaration::each([&](const LockDeclaration& lock) {
        if (lock.too_many()) plan_.refuse(text<std::string>("more than 32 heldBy() of ", lock.name()));
        for (const LockDeclaration::Section& said : lock.said()) {
            const bool known = said.handler != nullptr ||
                               std::ranges::count(table.loops, said.loop, &LoopDeclaration::id) > 0;
            const auto refuse = [&](auto... words) {
                plan_.refuse(text<std::string>(std::string_view{said.file}, ':', said.line, ": heldBy() of ",
                                               lock.name(), words...));
            };
            if (!known) refuse(" names loop ", said.loop, ", which the sketch does not declare");
            if (said.length < Nanoseconds{0} || said.length > sched::kPeriodMax)
                refuse(" says ", said.length, "; a length is 0 to 24 h");
            if (said.handler && handlers_of(said.handler).empty()) refuse(" names a handler that no pin has");
        }
    });
    LockDeclaration::each_section(
        table, board_, [this](const sched::CriticalSection& section) { plan_.add_section(section); },
        [this](sched::CriticalSection section, void (*handler)()) {
            for (const board::VcpuId io : handlers_of(handler)) {
                section.loop = io;
                plan_.add_section(section);
            }
        });
}

FixedVector<board::VcpuId, sched::kIoVcpuLimit> Runtime::handlers_of(void (*handler)()) const {
    FixedVector<board::VcpuId, sched::kIoVcpuLimit> found;
    for (const Handler& each : handlers_) {
        if (each.function == handler && std::ranges::count(found, each.io) == 0) found.push_back(each.io);
    }
    return found;
}

Result<void> Runtime::start_loops() {
    std::vector<board::VcpuSpec> specs = plan_.specs();
    for (board::VcpuSpec& spec : specs) {
        // Without an entry the board runs what is attached to it.
        if (spec.is_io()) continue;
        Loop& loop = loop_at(spec.id);
        loop.owns_core = spec.owns_core;
        if (options_.profile) loop.profile = std::make_unique<ExecutionProfile>();
        spec.classic = loop.declaration.classic;
        spec.entry = &Runtime::loop_entry;
        spec.context = &loop;
    }
    return board_.start(specs);
}

/// As the plan has it: with the I/O VCPU of its edge in front.
void Runtime::add_chain(Chain chain) {
    if (chain.has_handler()) {
        const board::VcpuId io = chain.source == Chain::Source::edge
                                     ? handlers_[chain.pin.number].io
                                     : io_of_device_[static_cast<std::size_t>(chain.device)];
        if (chain.stages.full()) {
            chain.wrong = "more than 8 stages";
        } else if (io == board::kNoVcpu) {
            chain.wrong = chain.source == Chain::Source::edge
                              ? "setup() attaches no interrupt handler to its pin"
                              : "setup() gives its device no I/O VCPU: interruptsVcpu()";
        } else {
            chain.stages.insert(0, {.vcpu = io});
        }
    }
    plan_.add_chain(chain);
}

void Runtime::watch_chains() {
    for (const ChainVerdict& verdict : plan_.chains()) {
        watches_.push_back(verdict.wrong.empty() ? std::make_unique<ChainWatch>(verdict) : nullptr);
        ChainWatch* const watch = watches_.back().get();
        for (std::size_t k = 0; watch && k < verdict.chain.stages.size(); ++k) {
            const board::VcpuId id = verdict.chain.stages[k].vcpu;
            if (id <= board::kMaxLoop) {
                loop_at(id).chains.push_back({watch, k});
            } else if (verdict.chain.source == Chain::Source::edge) {
                handlers_[verdict.chain.pin.number].chains.push_back({watch, k});
            }
        }
    }
}

/// Behind a change that was kept.
void Runtime::note_chain_bounds() {
    for (std::size_t i = 0; i < watches_.size(); ++i) {
        if (watches_[i]) watches_[i]->set_bound(plan_.chains()[i].bound);
    }
}

void Runtime::chains_begin(const Loop& loop, Instant now) {
    for (const ChainPlace& place : loop.chains) place.watch->begins(place.stage, now);
}

void Runtime::chains_end(const Loop& loop, Instant now) {
    for (const ChainPlace& place : loop.chains) place.watch->ends(place.stage, now);
}

/// Made when first named, which may be before its declaration is read (policies are set in
/// setup()).
Loop& Runtime::loop_at(board::VcpuId id) {
    if (!loops_[id]) loops_[id] = std::make_unique<Loop>();
    loops_[id]->runtime = this;
    return *loops_[id];
}

// ---- loops --------------------------------------------------------------------------------------

Loop* Runtime::current_loop() {
    const board::VcpuId id = board_.current_vcpu();
    return id <= board::kMaxLoop ? loops_[id].get() : nullptr;
}

void Runtime::loop_entry(void* context) {
    Loop& loop = *static_cast<Loop*>(context);
    loop.runtime->repeat(loop);
}

void Runtime::repeat(Loop& loop) {
    const Instant now = board_.now();
    loop.clock = ReleaseClock(origin(now), loop.declaration.period, now);
    begin_release(loop, {.nominal = loop.clock.nominal()});
    if (loop.profile) loop.profile->begin(board_);
    while (!board_.stop_requested()) {
        loop.waited = false;
        loop.statistics.passes.add(1);
        loop.declaration.body();
        record_latency(loop);
        if (!loop.waited) end_pass(loop);
    }
    loop.statistics.ended.add(1);
}

/// A body that has not waited ends no release. Its passes are profiled one by one.
void Runtime::end_pass(Loop& loop) {
    if (loop.profile) loop.profile->end(board_);
    board_.note_body_end();
    if (!loop.chains.empty()) {
        const Instant now = board_.now();
        chains_end(loop, now);
        chains_begin(loop, now);
    }
    if (loop.profile) loop.profile->begin(board_);
}

/// The instant that all loops count their releases from: when the first of them came up.
Instant Runtime::origin(Instant now) {
    std::int64_t unset = kNoOrigin;
    origin_ns_.compare_exchange_strong(unset, to_ns(now));
    return instant_from_ns(origin_ns_.load());
}

void Runtime::wait_for_next_period() {
    Loop* loop = current_loop();
    if (!loop) return;
    if (loop->profile) loop->profile->end(board_);
    const Instant ended = board_.now();
    chains_end(*loop, ended);
    if (!loop->progress_promised) [[unlikely]]
        promise_by_default(*loop);
    record_latency(*loop);
    loop->statistics.slept_ns_max.raise_to((board_.slept() - loop->slept_before).count());
    loop->statistics.sleeps_max.raise_to(board_.sleeps() - loop->sleeps_before);
    const Release release = loop->clock.next(ended, loop->policy);
    if (release.overrun()) count_overrun(*loop, release);
    if (release.nominal > ended) wait_until(*loop, release.nominal);
    loop->waited = true;
    begin_release(*loop, release);
    if (loop->profile) loop->profile->begin(board_);
}

/// An owning loop spins through the end of its wait: nobody else wants its core, and a wake-up
/// would make it late.
void Runtime::wait_until(const Loop& loop, Instant t) {
    if (!loop.owns_core) return board_.sleep_until(t);
    if (t - board_.now() > 2 * kSpinMargin) board_.sleep_until(t - kSpinMargin);
    board_.busy_until(t);
}

void Runtime::begin_release(Loop& loop, const Release& release) {
    const Instant now = board_.now();
    loop.latency = now - release.nominal;
    loop.statistics.release_began_ns.raise_to(to_ns(now));
    if (!release.overrun() || loop.policy != OverrunPolicy::keep_phase) loop.statistics.releases.add(1);
    loop.slept_before = board_.slept();
    chains_begin(loop, now);
    loop.sleeps_before = board_.sleeps();
    board_.note_release(release.nominal);
}

void Runtime::count_overrun(Loop& loop, const Release& release) {
    loop.statistics.overruns.add(1);
    loop.statistics.dropped.add(release.dropped);
    loop.statistics.lateness_ns_max.raise_to(release.lateness.count());
    board_.note_overrun(release.lateness);
    if (loop.policy == OverrunPolicy::stop) board_.request_stop();
    if (loop.policy == OverrunPolicy::call_back && loop.on_overrun) {
        loop.on_overrun(loop.declaration.id, release.lateness);
    }
}

void Runtime::yield() {
    const Loop* loop = current_loop();
    if (loop && loop->owns_core) {
        board_.busy_until(board_.now() + 1us);
    } else {
        board_.sleep_until(board_.now() + 20us);
    }
}

bool Runtime::is_no_loop(board::VcpuId id) const {
    return id < 1 || id > board::kMaxLoop || (begun_ && !loops_[id]);
}

void Runtime::set_overrun_policy(board::VcpuId id, OverrunPolicy policy, OverrunHandler handler) {
    if (is_no_loop(id)) return;
    loop_at(id).policy = policy;
    loop_at(id).on_overrun = handler;
}

// ---- progress -----------------------------------------------------------------------------------

void Runtime::promise_progress(board::VcpuId id, Nanoseconds limit) {
    if (is_no_loop(id)) return;
    loop_at(id).progress_promised = true;
    board_.promise_progress(id, std::max(limit, Nanoseconds{0}));
}

/// A loop that has waited for a period lives by its periods: a release that lasts for many of them
/// hangs, though it may poll or sleep meanwhile. One that has never waited may take its time, and
/// so may Arduino's own loop(): there a wait for a button is legal.
void Runtime::promise_by_default(Loop& loop) {
    loop.progress_promised = true;
    if (loop.declaration.classic) return;
    board_.promise_progress(loop.declaration.id,
                            std::max(options_.release_limit, 10 * loop.declaration.period));
}

// ---- interrupts ---------------------------------------------------------------------------------

Result<void> Runtime::interrupts_vcpu(board::DeviceClass device, Nanoseconds budget, Nanoseconds period,
                                      int core) {
    if (begun_) return change_io(device, {budget, period}, core);
    board::VcpuId& known = io_of_device_[static_cast<std::size_t>(device)];
    board::VcpuId io = known;
    if (io == board::kNoVcpu) {
        QDUINO_TRY_ASSIGN(io, plan_.add_io(budget, period, core));
    } else {
        plan_.redeclare_io(io, {budget, period}, core);
    }
    // The bottom halves of the GPIO class are the attached handlers.
    Result<void> served;
    if (device != board::DeviceClass::gpio) served = board_.serve_interrupts(device, io);
    if (!served) {
        if (known == board::kNoVcpu) plan_.remove_io(io);
        return served;
    }
    known = io;
    if (device == board::DeviceClass::gpio || device == board::DeviceClass::all) gpio_io_ = io;
    return {};
}

Result<void> Runtime::change_io(board::DeviceClass device, sched::VcpuParameters parameters, int core) {
    const board::VcpuId io = io_of_device_[static_cast<std::size_t>(device)];
    if (io == board::kNoVcpu)
        return make_error(ErrorCode::not_found, "interruptsVcpu: setup() gave this device no I/O VCPU");
    if (const int own = plan_.admission().core_of(io); core != kAnyCore && core != own)
        return make_error(ErrorCode::not_permitted, "interruptsVcpu: it stays on its core, ", own,
                          ", while the loops run");
    return one_at_a_time([&]() -> Result<void> {
        QDUINO_TRY(plan_.change_io(io, parameters, board_.now()));
        note_chain_bounds();
        return board_.change_io(io, parameters);
    });
}

Result<void> Runtime::attach_interrupt(board::PinId pin, board::Edge edge, void (*handler)(),
                                       Nanoseconds budget, Nanoseconds period, int core) {
    if (pin.number >= board::kPinCount || !handler) {
        return make_error(ErrorCode::invalid_argument, "attachInterrupt: no such pin, or no handler");
    }
    if (begun_) return attach_again(pin, edge, handler, budget);
    board::VcpuId io = gpio_io_;
    if (budget > Nanoseconds{0}) {
        QDUINO_TRY_ASSIGN(io, plan_.add_io(budget, period, core));
    } else if (io == board::kNoVcpu) {
        QDUINO_TRY_ASSIGN(io, plan_.add_io(options_.default_io_budget, options_.default_io_period, core));
        gpio_io_ = io_of_device_[static_cast<std::size_t>(board::DeviceClass::gpio)] = io;
    }
    if (!handlers_[pin.number].function) plan_.add_edges(io, board_.edge_cost());
    handlers_[pin.number] = {
        .runtime = this,
        .function = handler,
        .io = io,
        .profile = options_.profile ? std::make_unique<ExecutionProfile>(period) : nullptr,
        .chains = {}};
    return board_.attach_edge(pin, edge, &Runtime::run_handler, &handlers_[pin.number], io);
}

/// Admission knows this handler, on its I/O VCPU: it may go and come. An I/O VCPU keeps its budget,
/// however many edges come.
Result<void> Runtime::attach_again(board::PinId pin, board::Edge edge, void (*handler)(),
                                   Nanoseconds budget) {
    Handler& known = handlers_[pin.number];
    const bool own = known.io != gpio_io_;
    if (known.function != handler || own != (budget > Nanoseconds{0})) {
        return make_error(ErrorCode::not_permitted,
                          "attachInterrupt: while the loops run a pin takes back the handler that setup() "
                          "attached to it, and no other; attach it there, and detachInterrupt() it until "
                          "it is wanted");
    }
    return board_.attach_edge(pin, edge, &Runtime::run_handler, &known, known.io);
}

Result<void> Runtime::core_timer(int core, bool enabled) {
    // Without its timer a core keeps nobody's budget.
    const bool owned =
        plan_.owner_of(core) != board::kNoVcpu || (!enabled && !begun_ && plan_.give_core(core));
    if (!enabled && !owned) {
        return make_error(
            ErrorCode::not_permitted,
            "noTimer: no loop has this core to itself; name it in one loop's declaration alone");
    }
    return one_at_a_time([&]() -> Result<void> {
        QDUINO_TRY(board_.core_timer(core, enabled));
        const std::uint64_t before = std::exchange(tickless_, with_bit(tickless_, core, !enabled));
        if (tickless_ == before) return {};
        const Result<void> kept = keep_if_admitted(enabled ? "with its tick back" : "without its tick",
                                                   [&] { return board_.core_timer(core, !enabled); });
        if (!kept) tickless_ = before;
        return kept;
    });
}

/// What is undone is what the call has changed, and not the opposite of what it asked for: some of
/// it, or all, may have been so before.
Result<void> Runtime::route_interrupts(board::DeviceClass device, int core, bool allowed) {
    return one_at_a_time([&]() -> Result<void> {
        QDUINO_TRY(board_.route_interrupts(device, core, allowed));
        const auto before = away_;
        for (std::size_t each = 0; each < away_.size(); ++each) {
            if (device == board::DeviceClass::all || device == static_cast<board::DeviceClass>(each))
                away_[each] = with_bit(away_[each], core, !allowed);
        }
        if (away_ == before) return {};
        const Result<void> kept = keep_if_admitted("with these interrupts routed so", [&] {
            for (std::size_t each = 0; each < away_.size(); ++each) {
                if (away_[each] != before[each])
                    static_cast<void>(
                        board_.route_interrupts(static_cast<board::DeviceClass>(each), core, !allowed));
            }
        });
        if (!kept) away_ = before;
        return kept;
    });
}

/// The plan has one owner at a time. A loop that finds it taken does not wait: admission counts no
/// such wait.
template <typename Change>
Result<void> Runtime::one_at_a_time(Change change) {
    if (!board_.try_lock(changing_))
        return make_error(ErrorCode::unavailable, "another loop makes a change just now: call again");
    const Result<void> made = change();
    board_.unlock(changing_);
    return made;
}

/// What a core has to bear has changed. Before the loops run, admission is still to come.
template <typename Undo>
Result<void> Runtime::keep_if_admitted(const char* change, Undo undo) {
    if (!begun_) return {};
    for (std::size_t core = 0; core < overheads_.size(); ++core) {
        if (plan_.may_share(static_cast<int>(core)))
            overheads_[core] = board_.platform_overheads(static_cast<int>(core));
    }
    const Result<void> admitted = plan_.admit_again(overheads_, change, board_.now());
    if (admitted) note_chain_bounds();
    if (!admitted) static_cast<void>(undo());
    return admitted;
}

void Runtime::run_handler(void* context) {
    Handler& handler = *static_cast<Handler*>(context);
    board::Board& board = handler.runtime->board_;
    while (handler.runtime->handlers_held_.load(std::memory_order_acquire) && !board.stop_requested()) {
        // Held back on purpose: no handler hangs.
        board.note_progress();
        board.sleep_until(board.now() + kHeldRetry);
    }
    for (const ChainPlace& place : handler.chains) place.watch->begins_with_edge(board.handler_came());
    if (handler.profile) handler.profile->begin(board);
    handler.function();
    if (handler.profile) handler.profile->end(board);
    for (const ChainPlace& place : handler.chains) place.watch->ends(place.stage, board.now());
    handler.runtime->handler_runs_.fetch_add(1, std::memory_order_acq_rel);
}

}  // namespace qduino::runtime
