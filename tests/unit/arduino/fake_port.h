// A port made of memory: the functions of runtime/port.h over a virtual clock that tests set and records that tests read.
//
// Time moves only by busy_until and sleep_until, and by `look_cost` at every look at a pin, so that code that polls comes
// to an end and every instant can be worked out by hand.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "runtime/port.h"
#include "runtime/sketch.h"

namespace qduino::fake {

struct PinEvent {
    std::int64_t at_ns;
    int pin;
    int level;
    bool operator==(const PinEvent&) const = default;
};

struct PwmEvent {
    int pin;
    double duty;
};

struct PwmPeriod {
    int pin;
    std::int64_t period_ns;
    bool operator==(const PwmPeriod&) const = default;
};

struct I2cTransaction {
    int bus;
    int address;
    std::vector<std::uint8_t> out;
    std::size_t in_size;
    bool operator==(const I2cTransaction&) const = default;
};

struct InterruptRequest {
    int pin;
    port::Edge edge;
    void (*handler)();
    std::int64_t budget_ns;
    std::int64_t period_ns;
    int core;
};

/// Everything that the fake board is and has seen. `state()` is the only one; reset() before each test.
struct State {
    Instant now = kEpoch;
    Nanoseconds look_cost{};  ///< of each pin_read and now()
    board::VcpuId vcpu = board::kNoVcpu;
    bool stop = false;

    std::vector<PinEvent> writes;
    std::vector<PwmEvent> pwm;
    std::vector<PwmPeriod> pwm_periods;
    std::map<int, port::PinMode> modes;
    std::map<int, int> safe_states;
    std::vector<I2cTransaction> i2c;
    std::vector<std::string> calls;  ///< routing and the like, as text
    std::vector<InterruptRequest> attached;
    std::int64_t slept_ns = 0;
    std::int64_t spun_ns = 0;
    int waited_periods = 0;

    std::function<int(int pin, Instant now)> level_of = [](int, Instant) { return 0; };
    std::function<double(int pin)> analog_of = [](int) { return 0.0; };
    /// Fills `in`; false: nobody answers.
    std::function<bool(const I2cTransaction&, std::span<std::uint8_t> in)> chip = [](const auto&, auto) {
        return true;
    };
    std::function<void(board::SpiSettings, std::span<std::uint8_t>)> spi_device = [](auto, auto) {};
    std::function<void()> while_sleeping = [] {};  ///< called at each sleep, after time has moved
    bool refuse_everything = false;                ///< what can be refused, is
};

State& state();
void reset();
/// Levels written to `pin`, in order.
std::vector<int> levels_written(int pin);

}  // namespace qduino::fake
