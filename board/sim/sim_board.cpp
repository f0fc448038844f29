#include "board/sim/sim_board.h"

#include <algorithm>

#include "base/contract.h"

namespace qduino::board::sim {

namespace {

bool active(Instant now, Instant from, Instant until) { return from <= now && now < until; }

}  // namespace

SimBoard::SimBoard(SimConfig config, Peripherals& peripherals, TraceSink* trace)
    : peripherals_(peripherals), config_(std::move(config)), trace_(trace), interrupts_(config_) {
    QDUINO_EXPECT(config_.cores >= 1 && config_.cores <= 64 && config_.edge_poll_period > Nanoseconds{0});
    for (int core = 0; core < config_.cores; ++core) cores_.push_back(std::make_unique<SimCore>(*this, core));
    poll_limit_ = config_.poll_limit;
    wake_latency_ = config_.wake_latency;
    const ApiCosts& costs = config_.costs;
    calls_cost_ = std::any_of(costs.per_call.begin(), costs.per_call.end(),
                              [](Nanoseconds cost) { return cost > Nanoseconds{0}; });
    served_by_.fill(kNoVcpu);
    edges_are_reported_ = peripherals_.report_edges_to(*this);
}

SimBoard::~SimBoard() = default;

// ---- time -------------------------------------------------------------------------------------------------------

void SimBoard::consume(Nanoseconds cost) {
    if (cost <= Nanoseconds{0}) return;
    if (started_ && !current_ && !stopped_) return;  // the host looks on
    if (now_ + cost < horizon_) {
        now_ += cost;  // polls_ stays: a spinning loop goes on paying
        return;
    }
    QDUINO_EXPECT(current_ != nullptr);
    current_core_->account(now_);
    current_->work_left += cost;
    current_->fiber->suspend();
}

void SimBoard::busy_through_events(Instant t) {
    polls_ = 0;
    QDUINO_EXPECT(current_ !=
                  nullptr);  // the host has no time to spend between start() and the end of the run
    current_->spin_until = t;
    current_->fiber->suspend();
}

void SimBoard::sleep_through_events(Instant t) {
    charge(ApiCall::sleep);
    if (t <= now_) return;
    if (sleep_is_local_) return busy_through_events(t);
    polls_ = 0;
    QDUINO_EXPECT(current_ != nullptr);
    current_->state = VcpuState::sleeping;
    current_->wake = t;
    current_->fiber->suspend();
}

// ---- pins and buses ---------------------------------------------------------------------------------------------

Result<void> SimBoard::pin_mode(PinId pin, PinMode mode) {
    charge(ApiCall::pin_mode);
    if (pin.number >= kPinCount)
        return make_error(ErrorCode::invalid_argument, "no such pin: the board has 0…127");
    PinState& state = pins_[pin.number];
    const bool output = mode == PinMode::output || mode == PinMode::output_open_drain;
    if (output && !state.output) {
        state.output = true;
        pin_write(pin, state.level);  // what was written before shows from now on
    }
    state.output = output;
    return {};
}

Level SimBoard::pin_read(PinId pin) {
    before_poll(ApiCall::pin_read);
    if (pin.number >= kPinCount) return Level::low;
    const PinState& state = pins_[pin.number];
    Level level = state.level;
    if (stuck(pin, &level) || state.output) return level;
    return peripherals_.pin_level(now_, pin);
}

Result<void> SimBoard::pwm_write(PinId pin, double duty) {
    charge(ApiCall::pwm_write);
    if (pin.number >= kPinCount)
        return make_error(ErrorCode::invalid_argument, "no such pin: the board has 0…127");
    if (!(duty >= 0.0 && duty <= 1.0))
        return make_error(ErrorCode::invalid_argument, "a PWM duty is within 0…1");
    pins_[pin.number].pwm = true;
    hash_.mix(static_cast<std::uint64_t>(to_ns(now_)) ^ (std::uint64_t{pin.number} << 49));
    hash_.mix(static_cast<std::uint64_t>(duty * 4294967295.0));
    peripherals_.pwm_written(now_, pin, duty);
    return {};
}

Result<void> SimBoard::pwm_period(PinId pin, Nanoseconds period) {
    charge(ApiCall::pwm_write);
    if (pin.number >= kPinCount)
        return make_error(ErrorCode::invalid_argument, "no such pin: the board has 0…127");
    if (!is_pwm_period(period)) return bad_pwm_period();
    hash_.mix(static_cast<std::uint64_t>(to_ns(now_)) ^ (std::uint64_t{pin.number} << 49));
    hash_.mix(static_cast<std::uint64_t>(to_ns(period)));
    peripherals_.pwm_period_set(now_, pin, period);
    return {};
}

Result<double> SimBoard::analog_read(PinId pin) {
    before_poll(ApiCall::analog_read);
    if (pin.number >= kPinCount)
        return make_error(ErrorCode::invalid_argument, "no such pin: the board has 0…127");
    Level level = Level::low;
    if (stuck(pin, &level)) return level == Level::high ? 1.0 : 0.0;
    return std::clamp(peripherals_.analog_level(now_, pin), 0.0, 1.0);
}

Result<void> SimBoard::i2c_transfer(I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                                    std::span<std::uint8_t> in) {
    charge(ApiCall::i2c);
    const auto bytes = static_cast<std::int64_t>(out.size() + in.size() + 1);  // and the address
    consume(config_.costs.i2c_per_byte * bytes);
    for (const SilentChip& chip : config_.silent_chips) {
        if (chip.bus.number == bus.number && chip.address.value == address.value &&
            active(now_, chip.from, chip.until)) {
            return make_error(ErrorCode::timed_out, "no chip answers at this I2C address (injected fault)");
        }
    }
    return peripherals_.i2c_transfer(now_, bus, address, out, in);
}

Result<void> SimBoard::spi_transfer(SpiBus bus, SpiSettings settings, std::span<std::uint8_t> data) {
    charge(ApiCall::spi);
    consume(config_.costs.spi_per_byte * static_cast<std::int64_t>(data.size()));
    return peripherals_.spi_transfer(now_, bus, settings, data);
}

Result<void> SimBoard::safe_state(PinId pin, Level level) {
    if (pin.number >= kPinCount)
        return make_error(ErrorCode::invalid_argument, "no such pin: the board has 0…127");
    pins_[pin.number].has_safe_state = true;
    pins_[pin.number].safe_level = level;
    return {};
}

void SimBoard::force_safe_states() {
    for (std::uint16_t number = 0; number < kPinCount; ++number) {
        PinState& state = pins_[number];
        if (!state.has_safe_state) continue;
        const PinId pin{number};
        state.output = true;
        state.level = state.safe_level;
        hash_.pin_written(now_, pin, state.safe_level);
        if (state.pwm) peripherals_.pwm_written(now_, pin, state.safe_level == Level::high ? 1.0 : 0.0);
        peripherals_.pin_written(now_, pin, state.safe_level);
    }
}

bool SimBoard::stuck(PinId pin, Level* level) const {
    for (const StuckPin& fault : config_.stuck_pins) {
        if (fault.pin != pin || !active(now_, fault.from, fault.until)) continue;
        *level = fault.level;
        return true;
    }
    return false;
}

// ---- interrupts -------------------------------------------------------------------------------------------------

Result<void> SimBoard::attach_edge(PinId pin, Edge edge, EdgeHandler handler, void* context, VcpuId io) {
    if (pin.number >= kPinCount)
        return make_error(ErrorCode::invalid_argument, "no such pin: the board has 0…127");
    if (handler == nullptr) return make_error(ErrorCode::invalid_argument, "attach_edge without a handler");
    const bool known = io >= kFirstIoVcpu && io < kVcpuLimit && (!started_ || vcpus_[io]);
    if (!known || (started_ && !vcpus_[io]->queue)) {
        return make_error(ErrorCode::not_found, "attach_edge: no I/O VCPU of this number serves handlers");
    }
    PinState& state = pins_[pin.number];
    const Level level = state.output ? state.level : peripherals_.pin_level(now_, pin);
    watches_[pin.number] = {.edge = edge, .handler = handler, .context = context, .io = io, .last = level};
    state.watched = true;
    if (!edges_are_reported_ && next_poll_ == kForever) next_poll_ = now_ + config_.edge_poll_period;
    return {};
}

void SimBoard::detach_edge(PinId pin) {
    if (pin.number >= kPinCount) return;
    pins_[pin.number].watched = false;
    watches_[pin.number] = {};
}

void SimBoard::look_at(PinId pin, Level level) { pin_edge(now_, pin, level); }

void SimBoard::pin_edge(Instant now, PinId pin, Level level) {
    if (pin.number >= kPinCount || !pins_[pin.number].watched) return;
    EdgeWatch& watch = watches_[pin.number];
    Level forced = level;
    if (stuck(pin, &forced)) return;
    if (level == watch.last) return;
    watch.last = level;
    const Edge edge = level == Level::high ? Edge::rising : Edge::falling;
    if (watch.edge != Edge::both && watch.edge != edge) return;
    static_cast<void>(now);  // the instant of the call being served: now_
    give_work(watch.io, {.handler = watch.handler, .context = watch.context});
    if (config_.edge_top_half > Nanoseconds{0} && vcpus_[watch.io]) {
        vcpus_[watch.io]->core->steal(now_, config_.edge_top_half);
        horizon_ = now_;
    }
}

void SimBoard::poll_watched_pins() {
    for (std::uint16_t number = 0; number < kPinCount; ++number) {
        const PinState& state = pins_[number];
        if (state.watched && !state.output)
            look_at(PinId{number}, peripherals_.pin_level(now_, PinId{number}));
    }
}

Result<void> SimBoard::serve_interrupts(DeviceClass device, VcpuId io) {
    if (io != kNoVcpu && (io < kFirstIoVcpu || io >= kVcpuLimit)) {
        return make_error(ErrorCode::invalid_argument, "serve_interrupts: not the number of an I/O VCPU");
    }
    for (int d = 0; d < kDeviceClassCount; ++d) {
        if (device == DeviceClass::all || static_cast<int>(device) == d)
            served_by_[static_cast<std::size_t>(d)] = io;
    }
    return {};
}

Result<void> SimBoard::route_interrupts(DeviceClass device, int core, bool allowed) {
    if (core < 0 || core >= core_count())
        return make_error(ErrorCode::invalid_argument, "route_interrupts: no such core");
    if (interrupts_.route(device, core, allowed)) return {};
    return make_error(ErrorCode::unavailable,
                      "noInterrupts: no other core is left to take this device's interrupts");
}

Result<void> SimBoard::core_timer(int core, bool enabled) {
    if (core < 0 || core >= core_count())
        return make_error(ErrorCode::invalid_argument, "core_timer: no such core");
    if (!enabled && started_ && !cores_[static_cast<std::size_t>(core)]->owner()) {
        return make_error(ErrorCode::not_permitted,
                          "noTimer: the core is shared; give it to one loop (budget == period) first");
    }
    interrupts_.set_tick(core, enabled, now_);
    horizon_ = std::min(horizon_, interrupts_.next());
    return {};
}

void SimBoard::fire_interrupts() {
    Interrupts::Fired fired;
    while (interrupts_.take_due(now_, fired)) {
        SimCore& core = *cores_[static_cast<std::size_t>(fired.core)];
        emit(fired.core, static_cast<VcpuId>(fired.device), TraceKind::interrupt);
        core.steal(now_, fired.top_half);
        if (fired.bottom_half <= Nanoseconds{0} || fired.device == DeviceClass::all) continue;
        const VcpuId io = served_by_[static_cast<std::size_t>(fired.device)];
        if (io != kNoVcpu && vcpus_[io] && vcpus_[io]->queue) {
            give_work(io, {.cost = fired.bottom_half});
        } else {
            core.steal(now_, fired.bottom_half);
        }
    }
}

void SimBoard::give_work(VcpuId io, Work work) {
    Vcpu* vcpu = vcpus_[io].get();
    if (!vcpu || vcpu->state == VcpuState::finished || !vcpu->queue->try_push(work)) {
        ++lost_edges_;
        return;
    }
    if (vcpu->state == VcpuState::sleeping && vcpu->wake == kForever && !vcpu->waits_for) {
        vcpu->wake = now_;
        vcpu->core->settle_soon(now_);
        horizon_ = now_;  // whoever runs looks up before it takes more time
    }
}

// ---- starting ---------------------------------------------------------------------------------------------------

Result<void> SimBoard::check(const VcpuSpec& spec, std::span<const VcpuSpec> all) const {
    if (spec.core < 0 || spec.core >= core_count())
        return make_error(ErrorCode::not_found, "a VCPU asks for a core that is not there");
    const bool main = spec.kind == VcpuKind::main;
    if (main ? spec.id < 1 || spec.id > kMaxLoop : spec.id < kFirstIoVcpu || spec.id >= kVcpuLimit) {
        return make_error(ErrorCode::invalid_argument, "a VCPU's number is 1…32 (loop) or 33…63 (I/O)");
    }
    if (main && !spec.entry) return make_error(ErrorCode::invalid_argument, "a loop without an entry");
    for (const VcpuSpec& other : all) {
        if (&other == &spec || other.core != spec.core) continue;
        if (spec.owns_core)
            return make_error(ErrorCode::not_permitted, "a loop owns its core: nothing else may run there");
    }
    return {};
}

Result<void> SimBoard::start(std::span<const VcpuSpec> specs) {
    if (started_) return make_error(ErrorCode::already_exists, "start: the board runs already");
    for (const VcpuSpec& spec : specs) {
        if (Result<void> checked = check(spec, specs); !checked) return checked;
    }
    for (const VcpuSpec& spec : specs) {
        if (vcpus_[spec.id]) return make_error(ErrorCode::already_exists, "start: two VCPUs of one number");
        auto vcpu = std::make_unique<Vcpu>();
        vcpu->spec = spec;
        vcpu->board = this;
        vcpu->wake = spec.entry ? now_ : kForever;
        vcpu->has_fault = std::any_of(config_.loop_faults.begin(), config_.loop_faults.end(),
                                      [&](const LoopFault& fault) { return fault.loop == spec.id; });
        if (!spec.entry) vcpu->queue = std::make_unique<WorkQueue>();
        vcpu->fiber = std::make_unique<Fiber>(&SimBoard::vcpu_main, vcpu.get(), config_.stack_bytes);
        if (!cores_[static_cast<std::size_t>(spec.core)]->add(*vcpu, now_)) {
            return make_error(ErrorCode::invalid_argument,
                              "a VCPU needs 0 < budget <= period, and a number of its own");
        }
        vcpus_[spec.id] = std::move(vcpu);
        if (spec.kind == VcpuKind::main) ++unfinished_;
    }
    started_ = true;
    horizon_ = now_;
    return {};
}

void SimBoard::vcpu_main(void* vcpu) {
    Vcpu& self = *static_cast<Vcpu*>(vcpu);
    if (self.spec.entry) {
        self.spec.entry(self.spec.context);
    } else {
        self.board->serve(self);
    }
    self.state = VcpuState::finished;
}

void SimBoard::serve(Vcpu& io) {
    while (!stop_requested_) {
        if (io.queue->empty()) {
            io.state = VcpuState::sleeping;
            io.wake = kForever;
            io.fiber->suspend();
            continue;
        }
        const Work work = io.queue->pop();
        consume(work.cost);
        if (work.handler) work.handler(work.context);
    }
}

void SimBoard::apply_loop_faults(Vcpu& vcpu) {
    for (const LoopFault& fault : config_.loop_faults) {
        if (fault.loop == vcpu.spec.id && active(now_, fault.from, fault.until))
            vcpu.work_left += fault.extra;
    }
}

// ---- the event loop ---------------------------------------------------------------------------------------------

void SimBoard::run(Instant until) {
    QDUINO_EXPECT(started_ && current_ == nullptr);
    until_ = until;
    while (!stopped_ && now_ < until) {
        if (next_due() <= now_) {
            process_due();
        } else if (SimCore* core = runnable_core()) {
            execute(*core);
        } else {
            const Instant next = next_due();
            if (next >= until) break;
            now_ = next;
        }
        if (unfinished_ == 0) {
            stop_requested_ = true;
            stopped_ = true;
            force_safe_states();
        }
    }
    if (!stopped_ && until != kForever) now_ = std::max(now_, until);
    horizon_ = stopped_ ? kForever : now_;
    sleep_is_local_ = true;
}

Instant SimBoard::next_due() const {
    Instant next = std::min(interrupts_.next(), next_poll_);
    next = std::min(next, peripherals_.next_event(now_));
    for (const auto& core : cores_) next = std::min(next, core->next_due());
    return next;
}

void SimBoard::process_due() {
    if (peripherals_.next_event(now_) <= now_) {
        peripherals_.advance(now_);
        QDUINO_EXPECT(peripherals_.next_event(now_) > now_);
    }
    if (next_poll_ <= now_) {
        poll_watched_pins();
        next_poll_ = now_ + config_.edge_poll_period;
    }
    fire_interrupts();
    for (const auto& core : cores_) {
        if (core->next_due() <= now_) core->settle(now_);
    }
}

SimCore* SimBoard::runnable_core() {
    for (const auto& core : cores_) {
        if (core->ready()) return core.get();
    }
    return nullptr;
}

void SimBoard::execute(SimCore& core) {
    Vcpu& vcpu = *core.running();
    horizon_ = std::min(
        {until_, core.disturbed_at(), interrupts_.next(), next_poll_, peripherals_.next_event(now_)});
    for (const auto& other : cores_) {
        if (other.get() != &core) horizon_ = std::min(horizon_, other->ready() ? now_ : other->next_due());
    }
    sleep_is_local_ = vcpu.spec.owns_core && !vcpu.has_fault;
    current_ = &vcpu;
    current_core_ = &core;
    ++resumes_;
    polls_ = vcpu.polls;
    vcpu.fiber->resume();
    vcpu.polls = polls_;
    current_ = nullptr;
    current_core_ = nullptr;

    if (vcpu.state == VcpuState::finished && vcpu.spec.kind == VcpuKind::main) --unfinished_;
    if (vcpu.state != VcpuState::ready) core.give_up(vcpu, now_);
    core.decide(now_);
}

void SimBoard::request_stop() {
    if (stop_requested_) return;
    stop_requested_ = true;
}

void SimBoard::note(TraceKind kind) {
    if (current_) emit(current_->spec.core, current_->spec.id, kind);
}

void SimBoard::note_body_end() {
    if (!current_) return;
    if (current_->body_ended == now_) consume(config_.body_cost);
    current_->body_ended = now_;
}

void SimBoard::emit(int core, VcpuId vcpu, TraceKind kind) {
    const TraceEvent event{.time = now_, .core = static_cast<std::uint8_t>(core), .vcpu = vcpu, .kind = kind};
    hash_.event(event);
    if (trace_) trace_->on_event(event);
}

Nanoseconds SimBoard::cpu_time(VcpuId id) const {
    if (id >= kVcpuLimit || !vcpus_[id]) return Nanoseconds{0};
    return vcpus_[id]->core->cpu_time(id);
}

GuaranteeReport SimBoard::guarantee() const {
    GuaranteeReport report;
    report.board = "simulator";
    report.simulated = true;
    report.memory_locked = true;
    for (const auto& vcpu : vcpus_) {
        if (!vcpu) continue;
        const VcpuSpec& spec = vcpu->spec;
        report.loops.push_back({.id = spec.id,
                                .core = spec.core,
                                .budget = spec.budget,
                                .period = spec.period,
                                .priority_enforced = true,
                                .budget_enforced = true,
                                .core_owned = spec.owns_core,
                                .shortfall = {}});
    }
    for (const auto& core : cores_) {
        report.cores.push_back({.core = core->number(),
                                .interrupts_per_second = interrupts_.rate_hz(core->number()),
                                .worst_gap = Nanoseconds{-1},
                                .tick_stopped = !interrupts_.ticks(core->number()),
                                .throttling_lifted = true,
                                .note = "virtual time"});
    }
    return report;
}

sched::PlatformOverheads SimBoard::platform_overheads(int core) {
    sched::PlatformOverheads overheads;
    overheads.release_cost = 2 * config_.costs.context_switch;  // to it, and back to what it preempted
    for (const InterruptSource& source : interrupts_.on_core(core)) {
        Nanoseconds cost = source.top_half;
        const bool tick = source.device == DeviceClass::all;
        if (!tick && served_by_[static_cast<std::size_t>(source.device)] == kNoVcpu)
            cost += source.bottom_half;
        if (cost <= Nanoseconds{0} || overheads.interferers.full()) continue;
        overheads.interferers.push_back({.name = tick ? "tick" : "interrupts",
                                         .cost = cost,
                                         .interval = from_seconds(1.0 / source.rate_hz),
                                         .jitter = Nanoseconds{0}});
    }
    return overheads;
}

}  // namespace qduino::board::sim
