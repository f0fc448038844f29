#include "tests/unit/arduino/fake_port.h"

#include <algorithm>
#include <stdexcept>

namespace qduino::fake {

State& state() {
    static State only;
    return only;
}

void reset() { state() = State{}; }

std::vector<int> levels_written(int pin) {
    std::vector<int> levels;
    for (const PinEvent& event : state().writes) {
        if (event.pin == pin) levels.push_back(event.level);
    }
    return levels;
}

}  // namespace qduino::fake

namespace qduino::port {

using fake::state;

namespace {

Result<void> done_or_refused(std::string call) {
    state().calls.push_back(std::move(call));
    if (state().refuse_everything) return make_error(ErrorCode::not_permitted, "refused for the test");
    return {};
}

}  // namespace

Instant now() {
    state().now += state().look_cost;
    return state().now;
}
void busy_until(Instant t) {
    if (t <= state().now) return;
    state().spun_ns += to_ns(t - state().now);
    state().now = t;
}
void busy_for(Nanoseconds length) { busy_until(now() + length); }
void sleep_until(Instant t) {
    if (t > state().now) {
        state().slept_ns += to_ns(t - state().now);
        state().now = t;
    }
    state().while_sleeping();
}

Result<void> pin_mode(PinId pin, PinMode mode) {
    state().modes[pin.number] = mode;
    return {};
}
void pin_write(PinId pin, Level level) {
    state().writes.push_back({to_ns(state().now), pin.number, level == Level::high ? 1 : 0});
}
Level pin_read(PinId pin) {
    state().now += state().look_cost;
    return state().level_of(pin.number, state().now) ? Level::high : Level::low;
}
Result<void> pwm_write(PinId pin, double duty) {
    state().pwm.push_back({pin.number, duty});
    if (state().refuse_everything) return make_error(ErrorCode::unsupported, "no PWM on this pin");
    return {};
}
Result<void> pwm_period(PinId pin, Nanoseconds period) {
    state().pwm_periods.push_back({pin.number, to_ns(period)});
    if (state().refuse_everything) return make_error(ErrorCode::unsupported, "no PWM on this pin");
    return {};
}
Result<double> analog_read(PinId pin) {
    if (state().refuse_everything) return make_error(ErrorCode::unsupported, "no converter");
    return state().analog_of(pin.number);
}
Result<void> i2c_transfer(I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                          std::span<std::uint8_t> in) {
    const fake::I2cTransaction transaction{bus.number, address.value, {out.begin(), out.end()}, in.size()};
    state().i2c.push_back(transaction);
    if (state().refuse_everything) return make_error(ErrorCode::faulted, "the bus is stuck");
    if (!state().chip(transaction, in)) return make_error(ErrorCode::timed_out, "no answer");
    return {};
}
Result<void> spi_transfer(SpiBus, SpiSettings settings, std::span<std::uint8_t> data) {
    if (state().refuse_everything) return make_error(ErrorCode::faulted, "the bus is stuck");
    state().spi_device(settings, data);
    return {};
}
Result<void> safe_state(PinId pin, Level level) {
    state().safe_states[pin.number] = level == Level::high ? 1 : 0;
    return done_or_refused("safe_state");
}

void lock(board::LockWord& word) {
    for (int looks = 0; !try_lock(word); ++looks) {
        if (looks == 10'000) throw std::logic_error("a wait for a lock that does not end");
        sleep_until(state().now + 20us);  // whoever holds it runs in while_sleeping
    }
}
bool try_lock(board::LockWord& word) {
    if (word.value != 0) return false;
    word.value = state().vcpu + 1u;
    return true;
}
void unlock(board::LockWord& word) { word.value = 0; }

VcpuId current_vcpu() { return state().vcpu; }
void wait_for_next_period() { ++state().waited_periods; }
void yield() {}
void set_overrun_policy(VcpuId loop, std::uint8_t policy, void (*callback)(VcpuId, Nanoseconds)) {
    state().calls.push_back("overrun " + std::to_string(loop) + " " + std::to_string(policy));
    if (callback) callback(loop, Nanoseconds{7});
}

Result<void> interrupts_vcpu(std::uint8_t device, Nanoseconds budget, Nanoseconds period, int core) {
    return done_or_refused("io " + std::to_string(device) + " " + std::to_string(to_ns(budget)) + "/" +
                           std::to_string(to_ns(period)) + " core " + std::to_string(core));
}
Result<void> attach_interrupt(PinId pin, Edge edge, void (*handler)(), Nanoseconds budget, Nanoseconds period,
                              int core) {
    state().attached.push_back({pin.number, edge, handler, to_ns(budget), to_ns(period), core});
    return done_or_refused("attach");
}
void detach_interrupt(PinId pin) { state().calls.push_back("detach " + std::to_string(pin.number)); }
Result<void> route_interrupts(std::uint8_t device, int core, bool allowed) {
    return done_or_refused("route " + std::to_string(device) + " core " + std::to_string(core) +
                           (allowed ? " on" : " off"));
}
Result<void> core_timer(int core, bool enabled) {
    return done_or_refused("timer core " + std::to_string(core) + (enabled ? " on" : " off"));
}
void global_interrupts(bool enabled) { state().calls.push_back(enabled ? "handlers on" : "handlers off"); }

void request_stop() { state().stop = true; }
bool stop_requested() { return state().stop; }

}  // namespace qduino::port
