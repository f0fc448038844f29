// A simulated computer: cores, costs, interrupt sources, faults. Plain data; an app fills it in.
//
// Everything that takes time is set here, and by default nothing does but a byte on Serial. On the
// default computer only busy_until() consumes CPU time, so a schedule can be worked out by hand and
// compared to the nanosecond.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/time.h"
#include "board/types.h"

namespace qduino::board::sim {

/// Calls that can be given a cost in CPU time, charged to the calling VCPU before the call takes
/// effect.
enum class ApiCall : std::uint8_t {
    now,
    pin_mode,
    pin_write,
    pin_read,
    pwm_write,
    analog_read,
    i2c,
    spi,
    sleep,
    lock  ///< lock, try_lock and unlock
};
inline constexpr int kApiCallCount = 10;

struct ApiCosts {
    std::array<Nanoseconds, kApiCallCount> per_call{};
    Nanoseconds i2c_per_byte{};  ///< 90 µs at 100 kHz: eight bits and an acknowledge
    Nanoseconds spi_per_byte{};
    Nanoseconds uart_per_byte{};   ///< of Serial
    Nanoseconds nic_per_byte{};    ///< of sockets
    Nanoseconds context_switch{};  ///< taken from the core whenever it turns to another VCPU
    constexpr Nanoseconds& operator[](ApiCall call) { return per_call[static_cast<std::size_t>(call)]; }
    constexpr Nanoseconds operator[](ApiCall call) const { return per_call[static_cast<std::size_t>(call)]; }
};

enum class Arrival : std::uint8_t { periodic, poisson };

/// A device that interrupts. The top half stops whatever runs on the core and delays it; the bottom
/// half is work for the I/O VCPU that serves the device class, and where none does it runs at once,
/// above every loop, as on a stock kernel.
struct InterruptSource {
    DeviceClass device = DeviceClass::nic;
    double rate_hz = 0;  ///< > 0
    Arrival arrival = Arrival::poisson;
    int core = 0;
    Nanoseconds top_half{};
    Nanoseconds bottom_half{};
    Instant from = kEpoch;
    Instant lost_from = kForever;  ///< fault: from here on the interrupt never arrives
    /// Fault: from here on it fires at `stuck_rate_hz`, periodically.
    Instant stuck_from = kForever;
    double stuck_rate_hz = 100'000;
};

/// Fault: `loop` takes `extra` CPU time more at each of its releases in [from, until).
struct LoopFault {
    VcpuId loop = kNoVcpu;
    Instant from = kEpoch;
    Instant until = kForever;
    Nanoseconds extra{};
};

/// Fault: in [from, until) an input reads `level` whatever drives it, and its edges are lost.
struct StuckPin {
    PinId pin;
    Level level = Level::low;
    Instant from = kEpoch;
    Instant until = kForever;
};

/// Fault: in [from, until) nobody answers at this address.
struct SilentChip {
    I2cBus bus;
    I2cAddress address;
    Instant from = kEpoch;
    Instant until = kForever;
};

struct SimConfig {
    int cores = 2;           ///< 1…64
    std::uint64_t seed = 1;  ///< of Poisson arrivals
    ApiCosts costs{};

    std::vector<InterruptSource> interrupts{};
    Nanoseconds tick_period{};  ///< scheduling tick on every core; 0: none. 4 ms at 250 Hz
    Nanoseconds tick_cost{};
    /// How late a sleeper wakes: the slack of timers and the way out of idle. It is no CPU time,
    /// and a spin does not have it.
    Nanoseconds wake_latency{};
    /// The top half of every edge that has a handler, on the core of the handler's I/O VCPU.
    Nanoseconds edge_top_half{};
    /// No two top halves of a pin are closer than this: an edge that comes sooner is held back
    /// until then, one at the most, as by a line that is masked meanwhile. 0: nothing is held back,
    /// and nobody knows how often edges come.
    Nanoseconds edge_interval{};
    /// True: the interrupted VCPU's budget pays for top halves, as on a kernel that does not tell
    /// them apart. False: each interrupt is accounted for by itself.
    bool charge_interrupts_to_victim = false;

    std::vector<LoopFault> loop_faults{};
    std::vector<StuckPin> stuck_pins{};
    std::vector<SilentChip> silent_chips{};

    /// A byte on Serial takes its time at the baud rate, and a writer waits for room.
    bool serial_at_baud = true;

    /// How often inputs with an attached handler are looked at when the peripherals do not report
    /// edges; a shorter pulse may be missed.
    Nanoseconds edge_poll_period = 50us;
    /// A VCPU that asks for the time or a pin more than `poll_limit` times at one instant is
    /// spinning on it: each further call costs `poll_cost`, or `while (millis() < t);` would stand
    /// still for ever.
    std::uint32_t poll_limit = 1000;
    Nanoseconds poll_cost = 100ns;
    /// Charged when a loop's body returns without having let any time pass: it is called again at
    /// once, and virtual time would stand still. A body that spent or waited pays nothing.
    Nanoseconds body_cost = 100ns;
    /// So many basic blocks of a sketch may run at one instant; what runs on from there is taken
    /// for a spin, and takes time (spin_watch.h). In steps of 65536.
    std::uint32_t spin_limit = 1u << 25;
    std::size_t stack_bytes = 256 * 1024;  ///< of each VCPU; only touched pages take memory
};

}  // namespace qduino::board::sim
