#include "board/sim/event_loop.h"

#include <algorithm>

#include "base/contract.h"
#include "board/sim/sim_pins.h"

namespace qduino::board::sim {

EventLoop::EventLoop(const SimConfig& config, SimPins& pins, TraceSink* trace)
    : wake_latency_(config.wake_latency),
      config_(config),
      pins_(pins),
      trace_(trace),
      interrupts_(config),
      cpus_(*this, config),
      spins_(*this, config) {
    calls_cost_ = config.costs.per_call != ApiCosts{}.per_call;
    free_polls_ = calls_cost_ ? 0 : config.poll_limit;
}

/// A question to the host takes as long as so many to the board: 2 µs of virtual time, when the
/// system call behind it takes a host 0.2 to 2 µs. So a loop of them runs no slower than real time.
constexpr int kHostPolls = 20;

// ---- time ---------------------------------------------------------------------------------------

void EventLoop::consume(Nanoseconds cost) {
    if (cost <= Nanoseconds{0}) return;
    if (started_ && !current_ && !stopped_) return;  // the host looks on
    if (now_ + cost < horizon_) {
        now_ += cost;  // polls_ stays: a spinning loop goes on paying
        return;
    }
    if (!current_) return pass_setup_time_to(now_ + cost);
    current_->core->account(now_);
    current_->work_left += cost;
    current_->fiber->suspend();
}

void EventLoop::spin_for(Nanoseconds amount) {
    if (!current_ && !setup_) return;
    Vcpu* const self = current_;
    if (!self) return consume(amount);
    self->spinning = true;
    ++spinning_;
    consume(amount);
    self->spinning = false;
    --spinning_;
}

void EventLoop::charge_poll(ApiCall call) {
    if (calls_cost_) consume(config_.costs[call]);
    if (polls_ > config_.poll_limit) consume(config_.poll_cost);
}

void EventLoop::ask_host() {
    count_call();
    if (++polls_ <= config_.poll_limit) return;
    Spin& spin = spins_.spin_of_caller();
    const bool looked_at = spin.seen == now_;
    consume(config_.poll_cost * kHostPolls);
    if (looked_at) spin.seen = now_;
}

void EventLoop::busy_through_events(Instant t) {
    polls_ = 0;
    if (!current_) return pass_setup_time_to(t);
    current_->spin_until = t;
    current_->fiber->suspend();
}

/// The host itself has no time to spend between start() and the end of the run.
void EventLoop::pass_setup_time_to(Instant t) {
    QDUINO_EXPECT(setup_ != nullptr && !started_);
    while (t >= horizon_) setup_->suspend();
    pass_time_to(t);
}

void EventLoop::sleep_through_events(Instant t) {
    charge(ApiCall::sleep);
    if (t <= now_) return;
    if (sleep_is_local_) return busy_through_events(t);
    polls_ = 0;
    QDUINO_EXPECT(current_ != nullptr);
    current_->state = VcpuState::sleeping;
    current_->wake = t;
    current_->slept += t - now_;
    ++current_->sleeps;
    current_->fiber->suspend();
}

void EventLoop::wait() {
    polls_ = 0;
    current_->state = VcpuState::sleeping;
    current_->wake = kForever;
    current_->fiber->suspend();
}

// ---- VCPUs --------------------------------------------------------------------------------------

Result<void> EventLoop::start(std::span<const VcpuSpec> specs) {
    if (started_) return make_error(ErrorCode::already_exists, "start: the board runs already");
    QDUINO_TRY(cpus_.start(specs, now_, &EventLoop::vcpu_main));
    started_ = true;
    horizon_ = now_;
    return {};
}

void EventLoop::vcpu_main(void* vcpu) {
    Vcpu& self = *static_cast<Vcpu*>(vcpu);
    if (self.spec.entry) {
        self.spec.entry(self.spec.context);
    } else {
        self.loop->serve(self);
    }
    self.state = VcpuState::finished;
}

void EventLoop::serve(Vcpu& io) {
    for (;;) {
        if (io.queue->empty()) {
            if (stop_requested_) return;
            wait();
            continue;
        }
        const Work work = io.queue->pop();
        if (!stop_requested_) {
            const Instant began = now_;
            io.came = work.came;
            consume(work.cost);
            if (work.handler) work.handler(work.context);
            if (!work.waits) io.times.record(work.came, began, now_);
        }
        if (work.waits) wake_up(*work.waits);  // also at the end: nobody else would
    }
}

void EventLoop::wake_up(Vcpu& vcpu) {
    vcpu.wake = now_;
    vcpu.core->settle_soon(now_);
    look_up();
}

void EventLoop::work_of_device(DeviceClass device, Nanoseconds cost) {
    if (cost <= Nanoseconds{0}) return;
    tally_->bus.add(cost);
    Vcpu* const server = cpus_.vcpu(interrupts_.server_of(device));
    const bool served = server && server->queue && current_ && !current_->spec.is_io() && !stop_requested_;
    Vcpu* const caller = current_;
    if (!served || !server->queue->try_push({.cost = cost, .waits = caller})) return consume(cost);
    // The analysis knows no period of a client on another core. There the I/O VCPU works for the
    // usual client.
    server->core->work_came(*server, caller->core == server->core ? caller->spec.period : Nanoseconds{0},
                            now_);
    look_up();
    const Instant asked = now_;
    wait();
    caller->slept += now_ - asked;
    ++caller->sleeps;
}

void EventLoop::give_work(VcpuId io, Work work) {
    Vcpu* const vcpu = cpus_.vcpu(io);
    work.came = now_;
    if (!vcpu || vcpu->state == VcpuState::finished || !vcpu->queue->try_push(work)) {
        ++lost_work_;
        return;
    }
    vcpu->core->work_came(*vcpu, Nanoseconds{0}, now_);
    look_up();
}

// ---- from instant to instant --------------------------------------------------------------------

/// As the stack of a program's main thread; only touched pages take memory.
constexpr std::size_t kSetupStack = 8 * 1024 * 1024;

bool EventLoop::run_setup(void (*setup)(), Instant until) {
    QDUINO_EXPECT(!started_ && current_ == nullptr);
    const Counting counting(spins_);
    const auto call = [](void* function) { reinterpret_cast<void (*)()>(function)(); };
    if (!setup_) setup_ = std::make_unique<Fiber>(call, reinterpret_cast<void*>(setup), kSetupStack);
    leaving_ = false;
    horizon_ = until;
    setup_->resume();
    horizon_ = kForever;
    if (setup_->finished())
        setup_.reset();
    else if (!leaving_)
        now_ = std::max(now_, until);
    return !setup_;
}

void EventLoop::run(Instant until) {
    QDUINO_EXPECT(started_ && current_ == nullptr);
    const Counting counting(spins_);
    until_ = until;
    leaving_ = false;
    while (!stopped_ && now_ < until && !leaving_) {
        if (next_due() <= now_) {
            process_due();
        } else if (SimCore* core = cpus_.ready_core()) {
            execute(*core);
        } else {
            const Instant next = next_due();
            if (next >= until) break;
            now_ = next;
        }
        if (cpus_.all_finished()) end();
    }
    if (!stopped_ && until != kForever && !leaving_) now_ = std::max(now_, until);
    horizon_ = stopped_ ? kForever : now_;
    sleep_is_local_ = true;
}

void EventLoop::end() {
    stop_requested_ = true;
    stopped_ = true;
    pins_.force_safe_states();
}

Instant EventLoop::next_due() const {
    return std::min({interrupts_.next(), pins_.next_due(now_), cpus_.next_due()});
}

void EventLoop::process_due() {
    pins_.process_due(now_);
    fire_interrupts();
    cpus_.settle(now_);
}

void EventLoop::fire_interrupts() {
    Interrupts::Fired fired;
    while (interrupts_.take_due(now_, fired)) {
        SimCore& core = cpus_.core(fired.core);
        emit(fired.core, static_cast<VcpuId>(fired.device), TraceKind::interrupt);
        core.interrupt(now_, fired.top_half);
        const bool is_tick = fired.device == DeviceClass::all;
        Tally& tally = is_tick ? core.tally().ticks : core.tally().interrupts;
        tally.add(fired.top_half);
        if (fired.bottom_half <= Nanoseconds{0} || is_tick) continue;
        const VcpuId io = interrupts_.server_of(fired.device);
        if (const Vcpu* server = cpus_.vcpu(io); io != kNoVcpu && server && server->queue) {
            give_work(io, {.cost = fired.bottom_half});
        } else {
            core.interrupt(now_, fired.bottom_half);
            tally.time += fired.bottom_half;
        }
    }
}

void EventLoop::execute(SimCore& core) {
    Vcpu& vcpu = *core.running();
    horizon_ = std::min({until_, core.disturbed_at(), interrupts_.next(), pins_.next_due(now_),
                         cpus_.others_due(core, now_)});
    if (leaving_) horizon_ = now_;
    sleep_is_local_ = vcpu.spec.owns_core && !vcpu.has_fault;
    current_ = &vcpu;
    tally_ = &core.tally();
    ++resumes_;
    polls_ = vcpu.polls;
    vcpu.fiber->resume();
    vcpu.polls = polls_;
    tally_ = &host_;
    current_ = nullptr;

    if (vcpu.state == VcpuState::finished && !vcpu.spec.is_io()) cpus_.note_finished();
    if (vcpu.state != VcpuState::ready) core.give_up(vcpu, now_);
    if (spinning_ > 0) tell_spins(vcpu);
    core.decide(now_);
}

/// What two spins say to each other is seen so late at most. Between them nothing would end the
/// exchange at one instant.
constexpr Nanoseconds kBetweenSpins{100'000};

/// The code of `ran` may have changed what others spin for: they look now.
void EventLoop::tell_spins(const Vcpu& ran) {
    const Nanoseconds within = ran.spinning ? kBetweenSpins : Nanoseconds{0};
    cpus_.each([&](Vcpu& vcpu) {
        if (&vcpu == &ran || !vcpu.spinning || vcpu.spin.endless || vcpu.work_left <= within) return;
        vcpu.core->account(now_);
        vcpu.work_left = std::min(vcpu.work_left, within);
        vcpu.core->settle_soon(now_);
    });
}

// ---- what is seen of it -------------------------------------------------------------------------

void EventLoop::emit(int core, VcpuId vcpu, TraceKind kind) {
    const TraceEvent event{.time = now_, .core = static_cast<std::uint8_t>(core), .vcpu = vcpu, .kind = kind};
    hash_.event(event);
    if (!trace_) return;
    if (kind != TraceKind::interrupt) trace_->on_budget(cpus_.core(core).budget_left(vcpu, now_));
    trace_->on_event(event);
}

void EventLoop::note(TraceKind kind) {
    if (current_) emit(current_->spec.core, current_->spec.id, kind);
}

}  // namespace qduino::board::sim
