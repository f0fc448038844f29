#include "config/board_file.h"

#include <array>
#include <limits>
#include <utility>

#include "base/words.h"
#include "board/sim/block_count.h"
#include "config/part_tables.h"
#include "config/toml_section.h"

namespace qduino::apps {
namespace {

using board::DeviceClass;
using board::Level;
using board::linux::LinuxConfig;
using board::sim::ApiCall;
using board::sim::Arrival;
using board::sim::SimConfig;

// The words and keys that a file uses.
constexpr Words<Arrival::periodic, Arrival::poisson> kArrivals{"periodic", "poisson"};
constexpr Words<Level::low, Level::high> kLevels{"low", "high"};
constexpr Words<ApiCall::now, ApiCall::lock> kCalls{
    "now", "pin_mode", "pin_write", "pin_read", "pwm_write", "analog_read", "i2c", "spi", "sleep", "lock"};

constexpr double kSlowestHz = 1e-3, kFastestHz = 1e8;  // what the simulator takes
constexpr std::int64_t kLastDevice = 4095;
constexpr std::int64_t kSmallestStack = 64 * 1024, kLargestStack = std::int64_t{1} << 30;

// ---- the simulator ------------------------------------------------------------------------------

void read_costs(TomlSection& s, board::sim::ApiCosts& costs) {
    for (int i = 0; i < board::sim::kApiCallCount; ++i) {
        const auto call = static_cast<ApiCall>(i);
        s.duration(kCalls(call).data(), costs[call]);
    }
    s.duration("i2c_per_byte", costs.i2c_per_byte);
    s.duration("spi_per_byte", costs.spi_per_byte);
    s.duration("uart_per_byte", costs.uart_per_byte);
    s.duration("nic_per_byte", costs.nic_per_byte);
    s.duration("context_switch", costs.context_switch);
}

void read_interrupt(TomlSection& s, board::sim::InterruptSource& source, int cores) {
    s.choice("device", source.device, board::kDeviceNames);
    s.number("rate_hz", source.rate_hz, kSlowestHz, kFastestHz);
    s.choice("arrival", source.arrival, kArrivals);
    s.integer("core", source.core, 0, 63);
    s.duration("top_half", source.top_half);
    s.duration("bottom_half", source.bottom_half);
    s.instant("from", source.from);
    s.instant("lost_from", source.lost_from);
    s.instant("stuck_from", source.stuck_from);
    s.number("stuck_rate_hz", source.stuck_rate_hz, kSlowestHz, kFastestHz);
    if (source.core >= cores)
        s.fault("core", text<std::string>("is ", source.core, "; accepted: 0 to ", cores - 1,
                                          " ([sim] cores is ", cores, ")"));
}

/// The stretch of time in which a fault holds.
template <typename Fault>
void read_span(TomlSection& s, Fault& fault) {
    s.instant("from", fault.from);
    s.instant("until", fault.until);
    if (fault.until <= fault.from) s.fault("until", "is not after 'from'");
}

void read_faults(TomlSection& s, SimConfig& config) {
    s.tables("loop", config.loop_faults, {"loop", "extra"}, [](TomlSection& f, auto& fault) {
        f.integer("loop", fault.loop, 1, board::kMaxLoop);
        f.duration("extra", fault.extra, Nanoseconds{1});
        read_span(f, fault);
    });
    s.tables("pin", config.stuck_pins, {"pin", "level"}, [](TomlSection& f, auto& fault) {
        f.integer("pin", fault.pin.number, 0, kLastPin);
        f.choice("level", fault.level, kLevels);
        read_span(f, fault);
    });
    s.tables("chip", config.silent_chips, {"address"}, [](TomlSection& f, auto& fault) {
        f.integer("bus", fault.bus.number, 0, kLastBus);
        f.integer("address", fault.address.value, 0, 127);
        read_span(f, fault);
    });
}

void read_sim(TomlSection& s, SimConfig& config) {
    s.integer("cores", config.cores, 1, 64);
    s.integer("seed", config.seed, 0, std::numeric_limits<std::int64_t>::max());
    s.duration("tick_period", config.tick_period);
    s.duration("tick_cost", config.tick_cost);
    s.duration("wake_latency", config.wake_latency);
    s.duration("edge_top_half", config.edge_top_half);
    s.duration("edge_interval", config.edge_interval);
    s.flag("charge_interrupts_to_victim", config.charge_interrupts_to_victim);
    s.flag("serial_at_baud", config.serial_at_baud);
    s.duration("edge_poll_period", config.edge_poll_period, Nanoseconds{1});
    s.integer("poll_limit", config.poll_limit, 1, std::numeric_limits<std::uint32_t>::max());
    s.duration("poll_cost", config.poll_cost, Nanoseconds{1});
    s.duration("body_cost", config.body_cost, Nanoseconds{1});
    s.integer("spin_limit", config.spin_limit, board::sim::kBlocksPerLook,
              std::numeric_limits<std::uint32_t>::max());
    s.integer("stack_bytes", config.stack_bytes, kSmallestStack, kLargestStack);
    if (config.tick_cost > Nanoseconds{0} && config.tick_cost >= config.tick_period) {
        s.fault("tick_cost", "leaves nothing of 'tick_period'");
    }
    s.table("costs", [&](TomlSection& costs) { read_costs(costs, config.costs); });
    s.tables("interrupt", config.interrupts, {"device", "rate_hz"},
             [&](TomlSection& i, auto& source) { read_interrupt(i, source, config.cores); });
    s.table("fault", [&](TomlSection& faults) { read_faults(faults, config); });
}

// ---- Linux --------------------------------------------------------------------------------------

void read_linux(TomlSection& s, LinuxConfig& config) {
    s.text("pins", config.pins_path);
    s.flag("real_time", config.real_time);
    s.flag("lock_memory", config.lock_memory);
    s.flag("enforce_budgets", config.enforce_budgets);
    s.integer("priority_highest", config.priority_highest, 1, 99);
    s.integer("priority_lowest", config.priority_lowest, 1, 99);
    s.integer("stack_bytes", config.stack_bytes, kSmallestStack, kLargestStack);
    s.flag("handle_signals", config.handle_signals);
    s.duration("heartbeat_bound", config.heartbeat_bound, 1ms);
    s.duration("setup_bound", config.setup_bound, 0ms);
    s.flag("isolate", config.isolate);
    s.flag("lift_throttling", config.lift_throttling);
    s.text("settings_state", config.settings_state);
    s.duration("probe_duration", config.probe_duration);
    if (config.priority_lowest > config.priority_highest) {
        s.fault("priority_lowest",
                text<std::string>("is above 'priority_highest' (", config.priority_highest, ")"));
    }
}

/// Pins and buses that have a device, so that none gets two.
struct Wired {
    std::array<bool, board::kPinCount> pins{};
    std::array<bool, kLastBus + 1> i2c{};
    std::array<bool, kLastBus + 1> spi{};
};

template <std::size_t N>
void claim(TomlSection& s, const char* key, std::array<bool, N>& taken, std::size_t number) {
    if (std::exchange(taken[number], true))
        s.fault(key, text<std::string>("is ", number, ", which has a device already"));
}

void read_pins(TomlSection& root, LinuxConfig& config, Wired& wired) {
    root.tables("gpio", config.gpio, {"pin", "line"}, [&](TomlSection& s, auto& line) {
        s.integer("pin", line.pin.number, 0, kLastPin);
        s.integer("chip", line.chip, 0, kLastDevice);
        s.integer("line", line.line, 0, 65535);
        claim(s, "pin", wired.pins, line.pin.number);
    });
    root.tables("pwm", config.pwm, {"pin", "channel"}, [&](TomlSection& s, auto& channel) {
        s.integer("pin", channel.pin.number, 0, kLastPin);
        s.integer("chip", channel.chip, 0, kLastDevice);
        s.integer("channel", channel.channel, 0, kLastDevice);
        s.duration("period", channel.period, 1us);
        claim(s, "pin", wired.pins, channel.pin.number);
    });
    root.tables("analog", config.analog, {"pin", "channel"}, [&](TomlSection& s, auto& channel) {
        s.integer("pin", channel.pin.number, 0, kLastPin);
        s.integer("device", channel.device, 0, kLastDevice);
        s.integer("channel", channel.channel, 0, kLastDevice);
        s.number("full_scale", channel.full_scale, 1, 4294967295.0);
        claim(s, "pin", wired.pins, channel.pin.number);
    });
}

void read_buses(TomlSection& root, LinuxConfig& config, Wired& wired) {
    root.tables("i2c", config.i2c, {"adapter"}, [&](TomlSection& s, auto& port) {
        s.integer("bus", port.bus.number, 0, kLastBus);
        s.integer("adapter", port.adapter, 0, kLastDevice);
        claim(s, "bus", wired.i2c, port.bus.number);
    });
    root.tables("spi", config.spi, {"controller"}, [&](TomlSection& s, auto& port) {
        s.integer("bus", port.bus.number, 0, kLastBus);
        s.integer("controller", port.controller, 0, kLastDevice);
        s.integer("chip_select", port.chip_select, 0, 255);
        claim(s, "bus", wired.spi, port.bus.number);
    });
}

void read_board(TomlSection& root, BoardFile& board) {
    root.table("sim", [&](TomlSection& s) { read_sim(s, board.sim); });
    root.table("linux", [&](TomlSection& s) { read_linux(s, board.linux); });
    Wired wired;
    read_pins(root, board.linux, wired);
    read_buses(root, board.linux, wired);
    read_parts(root, board.parts);
}

}  // namespace

ReadBoardFile parse_board(std::string_view text, std::string_view name) {
    ReadBoardFile read;
    read.error = read_toml(text, name, [&](TomlSection& root) { read_board(root, read.board); });
    return read;
}

ReadBoardFile read_board_file(const std::filesystem::path& path) {
    const Result<std::string> read = posix::read_small_file(path);
    if (read) return parse_board(*read, path.string());
    return {.board = {}, .error = "board file " + path.string() + " cannot be read: check its path"};
}

std::string why_cores_do_not_fit(const SimConfig& config) {
    for (const board::sim::InterruptSource& source : config.interrupts) {
        if (source.core < config.cores) continue;
        return text<std::string>("an interrupt source of the board is on core ", source.core,
                                 ", but there are only ", config.cores, " cores");
    }
    return {};
}

}  // namespace qduino::apps
