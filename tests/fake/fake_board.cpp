#include "tests/fake/fake_board.h"

#include <algorithm>
#include <stdexcept>

namespace qduino::fake {

using board::Level;
using board::PinId;

FakeBoard& board() {
    static FakeBoard only;
    return only;
}
State& state() { return board().state; }
void reset() { state() = State{}; }

std::vector<int> levels_written(int pin) {
    std::vector<int> levels;
    for (const PinEvent& event : state().writes) {
        if (event.pin == pin) levels.push_back(event.level);
    }
    return levels;
}

// ---- time ---------------------------------------------------------------------------------------

Instant FakeBoard::now() { return state.now += state.look_cost; }

/// True when the caller is a VCPU that was started: it went on at `t`.
bool FakeBoard::wait_in_fiber(Instant t) {
    if (!running_) return false;
    running_->wake = t;
    running_->fiber->suspend();
    return true;
}

void FakeBoard::busy_until(Instant t) {
    if (t <= state.now || wait_in_fiber(t)) return;
    state.spun_ns += to_ns(t - state.now);
    state.now = t;
}

void FakeBoard::sleep_until(Instant t) {
    if (t > state.now && !wait_in_fiber(t)) {
        state.slept_ns += to_ns(t - state.now);
        state.now = t;
    }
    state.while_sleeping();
}

// ---- pins and buses -----------------------------------------------------------------------------

Result<void> FakeBoard::done_or_refused(std::string call) {
    state.calls.push_back(std::move(call));
    if (state.refuse_everything) return make_error(ErrorCode::not_permitted, "refused for the test");
    return {};
}

bool FakeBoard::is_output(PinId pin) const {
    const auto mode = state.modes.find(pin.number);
    return mode != state.modes.end() &&
           (mode->second == board::PinMode::output || mode->second == board::PinMode::output_open_drain);
}

Result<void> FakeBoard::pin_mode(PinId pin, board::PinMode mode) {
    if (pin.number >= board::kPinCount) return make_error(ErrorCode::invalid_argument, "no such pin");
    state.modes[pin.number] = mode;
    drive(pin);
    return {};
}

void FakeBoard::pin_write(PinId pin, Level level) {
    if (pin.number >= board::kPinCount) return;
    state.writes.push_back({to_ns(state.now), pin.number, level == Level::high ? 1 : 0});
    levels_[pin.number] = level;
    drive(pin);
}

void FakeBoard::drive(PinId pin) {
    if (!is_output(pin) || !state.wires) return;
    state.wires->pin_written(state.now, pin, levels_[pin.number]);
    look_at_edges();
}

Level FakeBoard::pin_read(PinId pin) {
    state.now += state.look_cost;
    if (!state.wires) return state.level_of(pin.number, state.now) ? Level::high : Level::low;
    if (pin.number < board::kPinCount && is_output(pin)) return levels_[pin.number];
    return state.wires->pin_level(state.now, pin);
}

Result<void> FakeBoard::safe_state(PinId pin, Level level) {
    if (pin.number >= board::kPinCount) return make_error(ErrorCode::invalid_argument, "no such pin");
    state.safe_states[pin.number] = level == Level::high ? 1 : 0;
    return done_or_refused("safe_state");
}

Result<void> FakeBoard::pwm_write(PinId pin, double duty) {
    if (pin.number >= board::kPinCount || !(duty >= 0 && duty <= 1))
        return make_error(ErrorCode::invalid_argument, "no such pin, or no such duty");
    state.pwm.push_back({pin.number, duty});
    if (state.refuse_everything) return make_error(ErrorCode::unsupported, "no PWM on this pin");
    if (state.wires) state.wires->pwm_written(state.now, pin, duty);
    return {};
}

Result<void> FakeBoard::pwm_period(PinId pin, Nanoseconds period) {
    if (pin.number >= board::kPinCount) return make_error(ErrorCode::invalid_argument, "no such pin");
    if (!board::is_pwm_period(period)) return board::bad_pwm_period();
    state.pwm_periods.push_back({pin.number, to_ns(period)});
    if (state.refuse_everything) return make_error(ErrorCode::unsupported, "no PWM on this pin");
    if (state.wires) state.wires->pwm_period_set(state.now, pin, period);
    return {};
}

Result<double> FakeBoard::analog_read(PinId pin) {
    if (pin.number >= board::kPinCount) return make_error(ErrorCode::invalid_argument, "no such pin");
    if (state.refuse_everything) return make_error(ErrorCode::unsupported, "no converter");
    return state.wires ? state.wires->analog_level(state.now, pin) : state.analog_of(pin.number);
}

Result<double> FakeBoard::chip_temperature() {
    if (state.refuse_everything) return make_error(ErrorCode::not_found, "no thermometer");
    return state.chip_celsius;
}

Result<void> FakeBoard::i2c_transfer(board::I2cBus bus, board::I2cAddress address,
                                     std::span<const std::uint8_t> out, std::span<std::uint8_t> in) {
    const I2cTransaction transaction{bus.number, address.value, {out.begin(), out.end()}, in.size()};
    state.i2c.push_back(transaction);
    if (state.refuse_everything) return make_error(ErrorCode::faulted, "the bus is stuck");
    if (state.wires) return state.wires->i2c_transfer(state.now, bus, address, out, in);
    if (!state.chip(transaction, in)) return make_error(ErrorCode::timed_out, "no answer");
    return {};
}

Result<void> FakeBoard::spi_transfer(board::SpiBus bus, board::SpiSettings settings,
                                     std::span<std::uint8_t> data) {
    if (state.refuse_everything) return make_error(ErrorCode::faulted, "the bus is stuck");
    if (state.wires) return state.wires->spi_transfer(state.now, bus, settings, data);
    state.spi_device(settings, data);
    return {};
}

// ---- edges --------------------------------------------------------------------------------------

Result<void> FakeBoard::attach_edge(PinId pin, board::Edge edge, board::EdgeHandler handler, void* context,
                                    board::VcpuId io) {
    if (pin.number >= board::kPinCount || !handler || io < board::kFirstIoVcpu)
        return make_error(ErrorCode::invalid_argument, "no such pin, no handler, or no I/O VCPU");
    state.attached.push_back({pin.number, edge, handler, context, io, Level::low});
    return done_or_refused("attach");
}

void FakeBoard::detach_edge(PinId pin) {
    for (AttachedEdge& one : state.attached) one.detached |= one.pin == pin.number;
    state.calls.push_back("detach " + std::to_string(pin.number));
}

/// Hands the edges that there were since the last look to their VCPUs.
void FakeBoard::look_at_edges() {
    for (AttachedEdge& one : state.attached) {
        const Level level = state.wires->pin_level(state.now, PinId{static_cast<std::uint16_t>(one.pin)});
        if (one.detached || level == std::exchange(one.last, level)) continue;
        if (one.edge == (level == Level::high ? board::Edge::falling : board::Edge::rising)) continue;
        for (const auto& vcpu : vcpus_) {
            if (vcpu->spec.id != one.io) continue;
            vcpu->handlers.emplace_back(one.handler, one.context);
            vcpu->wake = std::min(vcpu->wake, state.now);
        }
    }
}

// ---- locks --------------------------------------------------------------------------------------

void FakeBoard::lock(board::LockWord& word) {
    for (int looks = 0; !try_lock(word); ++looks) {
        if (looks == 10'000) throw std::logic_error("a wait for a lock that does not end");
        sleep_until(state.now + 20us);  // whoever holds it runs meanwhile, or in while_sleeping
    }
}
bool FakeBoard::try_lock(board::LockWord& word) {
    if (word.value != 0) return false;
    word.value = state.vcpu + 1u;
    return true;
}
void FakeBoard::unlock(board::LockWord& word) { word.value = 0; }

// ---- VCPUs --------------------------------------------------------------------------------------

Result<void> FakeBoard::start(std::span<const board::VcpuSpec> specs) {
    for (const board::VcpuSpec& spec : specs) {
        const auto same =
            std::count_if(specs.begin(), specs.end(), [&](const auto& s) { return s.id == spec.id; });
        const bool sound = spec.id != board::kNoVcpu && same == 1 && spec.core >= 0 &&
                           spec.core < core_count() && spec.budget > Nanoseconds{0} &&
                           spec.budget <= spec.period && (spec.entry || spec.kind == board::VcpuKind::io);
        if (!sound) return make_error(ErrorCode::invalid_argument, "not the description of a VCPU");
    }
    for (const board::VcpuSpec& spec : specs) {
        auto& vcpu = *vcpus_.emplace_back(std::make_unique<Vcpu>());
        vcpu.spec = spec;
        vcpu.board = this;
        vcpu.wake = spec.entry ? state.now : kForever;
        vcpu.fiber = std::make_unique<board::sim::Fiber>(&FakeBoard::vcpu_main, &vcpu, std::size_t{1} << 18);
        if (spec.entry) ++loops_left_;
    }
    return {};
}

void FakeBoard::vcpu_main(void* argument) {
    Vcpu& self = *static_cast<Vcpu*>(argument);
    if (self.spec.entry) return self.spec.entry(self.spec.context);
    for (;;) {  // until the board goes
        while (!self.handlers.empty()) {
            const auto [handler, context] = self.handlers.front();
            self.handlers.pop_front();
            handler(context);
        }
        self.board->wait_in_fiber(kForever);
    }
}

void FakeBoard::resume(Vcpu& vcpu) {
    running_ = &vcpu;
    state.vcpu = vcpu.spec.id;
    vcpu.fiber->resume();
    state.vcpu = board::kNoVcpu;
    running_ = nullptr;
    if (!vcpu.fiber->finished()) return;
    vcpu.wake = kForever;
    if (--loops_left_ == 0) force_safe_states();
}

void FakeBoard::run(Instant until) {
    while (loops_left_ > 0) {
        const auto first = std::min_element(vcpus_.begin(), vcpus_.end(),
                                            [](const auto& a, const auto& b) { return a->wake < b->wake; });
        if ((*first)->wake >= until) {
            if (until != kForever) state.now = std::max(state.now, until);
            return;
        }
        state.now = std::max(state.now, (*first)->wake);
        resume(**first);
    }
}

void FakeBoard::force_safe_states() {
    for (const auto& [number, level] : state.safe_states) {
        const PinId pin{static_cast<std::uint16_t>(number)};
        const bool pwm = std::any_of(state.pwm.begin(), state.pwm.end(),
                                     [&](const PwmEvent& event) { return event.pin == pin.number; });
        if (pwm) static_cast<void>(pwm_write(pin, level));
        state.modes[number] = board::PinMode::output;
        pin_write(pin, level ? Level::high : Level::low);
    }
}

board::GuaranteeReport FakeBoard::guarantee() const {
    board::GuaranteeReport report;
    report.board = "fake";
    report.simulated = true;
    for (const auto& vcpu : vcpus_) {
        report.loops.push_back({vcpu->spec, false, false, false, "a fake board schedules nothing"});
    }
    return report;
}

Result<void> FakeBoard::serve_interrupts(board::DeviceClass device, board::VcpuId io) {
    return done_or_refused("device " + std::to_string(static_cast<int>(device)) + " io " +
                           std::to_string(io));
}
Result<void> FakeBoard::change_io(board::VcpuId io, sched::VcpuParameters parameters) {
    const auto vcpu = std::ranges::find_if(vcpus_, [&](const auto& each) { return each->spec.id == io; });
    if (vcpu == vcpus_.end() || !(*vcpu)->spec.is_io())
        return make_error(ErrorCode::not_found, "there is no I/O VCPU ", io);
    (*vcpu)->spec.budget = parameters.budget;
    (*vcpu)->spec.period = parameters.period;
    return {};
}
Result<void> FakeBoard::route_interrupts(board::DeviceClass device, int core, bool allowed) {
    return done_or_refused("route " + std::to_string(static_cast<int>(device)) + " core " +
                           std::to_string(core) + (allowed ? " on" : " off"));
}
Result<void> FakeBoard::core_timer(int core, bool enabled) {
    return done_or_refused("timer core " + std::to_string(core) + (enabled ? " on" : " off"));
}

}  // namespace qduino::fake
