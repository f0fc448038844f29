// Options of the Linux board: the devices behind its pins and buses, and how far it may change the
// computer. Plain data; an app fills it in.
#pragma once

#include <csignal>
#include <string>
#include <vector>

#include "base/time.h"
#include "board/types.h"

namespace qduino::board::linux {

/// A pin that is a line of a kernel GPIO chip.
struct GpioLine {
    PinId pin;
    unsigned chip = 0;  ///< N of /dev/gpiochipN
    unsigned line = 0;  ///< offset on that chip
};
/// A pin whose PWM is made by a kernel PWM channel.
struct PwmChannel {
    PinId pin;
    unsigned chip = 0;  ///< N of /sys/class/pwm/pwmchipN
    unsigned channel = 0;
    Nanoseconds period = 1ms;
};
/// An analog pin that is a channel of a kernel IIO device.
struct AnalogChannel {
    PinId pin;
    unsigned device = 0;   ///< N of /sys/bus/iio/devices/iio:deviceN
    unsigned channel = 0;  ///< in_voltageN_raw
    double full_scale = 4095;
};
/// I2C bus `bus` of the sketch is /dev/i2c-`adapter`.
struct I2cPort {
    I2cBus bus;
    unsigned adapter = 0;
};
/// SPI bus `bus` of the sketch is /dev/spidev`controller`.`chip_select`.
struct SpiPort {
    SpiBus bus;
    unsigned controller = 0;
    unsigned chip_select = 0;
};

struct LinuxConfig {
    /// File of virtual pins (pins_layout.h); empty: none. Pins and buses not named below are
    /// virtual.
    std::string pins_path;
    std::vector<GpioLine> gpio;
    std::vector<PwmChannel> pwm;
    std::vector<AnalogChannel> analog;
    std::vector<I2cPort> i2c;
    std::vector<SpiPort> spi;

    /// Ask for SCHED_FIFO; what is refused is in the guarantee report.
    bool real_time = true;
    bool lock_memory = true;  ///< mlockall: no page fault after start
    /// A loop that has spent its budget sleeps until its replenishment.
    bool enforce_budgets = true;
    /// A warden keeps those to their budgets that escape (warden.h). Tests alone switch it off.
    bool warden = true;
    int priority_highest = 80;  ///< of the shortest period; 1…99
    int priority_lowest = 40;   ///< longer periods than there are priorities share this one
    std::size_t stack_bytes = std::size_t{1} << 20;  ///< of each VCPU, faulted in before it starts

    /// Says why the sketch dies, in a handler of a fatal signal: fatal_signals.h.
    void (*last_words)(int signal, const siginfo_t* info, const void* machine_context) = nullptr;
    /// SIGINT, SIGTERM stop the board; fatal signals force the safe states first.
    bool handle_signals = true;
    /// A loop counts as hung when it was not heard of for so long, and has not announced a longer
    /// sleep or spin.
    Nanoseconds heartbeat_bound = 500ms;
    /// setup() counts as hung when it has lasted so long without progress(); 0: it may take as long
    /// as it likes.
    Nanoseconds setup_bound = 10s;

    /// Take everything else off the cores that loops own (isolation.h). Changes the computer;
    /// undone at the end.
    bool isolate = false;
    /// Lift the kernel's limit of 95 % real-time per second, and its fair server, while a core is
    /// owned and empty.
    bool lift_throttling = true;
    /// How long to wait for a core that another sketch owns: its holder may be dying (core_lock.h).
    Nanoseconds core_patience = 2s;
    /// Where changes to the computer are recorded, for the supervisor and `qduino restore`.
    std::string settings_state = "/run/qduino/settings.state";
    /// How long each owned core is probed by a bare spin before its loop starts; 0: no probe.
    Nanoseconds probe_duration = 100ms;
    std::string sysfs_root;  ///< prefix of /sys and /proc, for tests
};

}  // namespace qduino::board::linux
