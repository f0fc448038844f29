#include "config/board_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace qduino::apps::board_file_test {
namespace {

using board::DeviceClass;
using board::Level;
using board::sim::ApiCall;
using board::sim::Arrival;

std::string error_of(std::string_view text) { return parse_board(text, "b.toml").error; }

/// What stands between ```toml and ``` in a page.
std::string example_of(const std::string& page) {
    std::ifstream file(std::string(QDUINO_DOCS) + "/" + page);
    std::ostringstream whole;
    whole << file.rdbuf();
    const std::string text = whole.str();
    const std::size_t begin = text.find("```toml\n");
    const std::size_t end = text.find("\n```", begin);
    return begin == std::string::npos ? "" : text.substr(begin + 8, end - begin - 7);
}

TEST(BoardFile, AnEmptyFileIsTheDefaultBoard) {
    const ReadBoardFile read = parse_board("", "b.toml");
    ASSERT_TRUE(read.ok()) << read.error;
    EXPECT_EQ(read.board.sim.cores, 2);
    EXPECT_EQ(read.board.sim.body_cost, 100ns);
    EXPECT_TRUE(read.board.sim.interrupts.empty());
    EXPECT_EQ(read.board.linux.priority_highest, 80);
    EXPECT_TRUE(read.board.linux.gpio.empty());
}

TEST(BoardFile, TheExampleOfThePageSaysEverythingThatCanBeSaidOfASimulator) {
    const ReadBoardFile read = parse_board(example_of("board-file.md"), "docs/board-file.md");
    ASSERT_TRUE(read.ok()) << read.error;
    const board::sim::SimConfig& sim = read.board.sim;
    EXPECT_EQ(sim.cores, 4);
    EXPECT_EQ(sim.seed, 7u);
    EXPECT_EQ(sim.tick_period, 4ms);
    EXPECT_EQ(sim.tick_cost, 2us);
    EXPECT_EQ(sim.wake_latency, 50us);
    EXPECT_EQ(sim.edge_top_half, 3us);
    EXPECT_EQ(sim.edge_interval, 100us);
    EXPECT_TRUE(sim.charge_interrupts_to_victim);
    EXPECT_FALSE(sim.serial_at_baud);
    EXPECT_EQ(sim.edge_poll_period, 20us);
    EXPECT_EQ(sim.poll_limit, 500u);
    EXPECT_EQ(sim.poll_cost, 200ns);
    EXPECT_EQ(sim.body_cost, 150ns);
    EXPECT_EQ(sim.spin_limit, 1000000u);
    EXPECT_EQ(sim.stack_bytes, 131072u);

    EXPECT_EQ(sim.costs[ApiCall::now], 30ns);
    EXPECT_EQ(sim.costs[ApiCall::pin_mode], 5us);
    EXPECT_EQ(sim.costs[ApiCall::pin_write], 120ns);
    EXPECT_EQ(sim.costs[ApiCall::pin_read], 110ns);
    EXPECT_EQ(sim.costs[ApiCall::pwm_write], 2us);
    EXPECT_EQ(sim.costs[ApiCall::analog_read], 40us);
    EXPECT_EQ(sim.costs[ApiCall::i2c], 15us);
    EXPECT_EQ(sim.costs[ApiCall::spi], 8us);
    EXPECT_EQ(sim.costs[ApiCall::sleep], 1us);
    EXPECT_EQ(sim.costs[ApiCall::lock], 60ns);
    EXPECT_EQ(sim.costs.i2c_per_byte, 90us);
    EXPECT_EQ(sim.costs.spi_per_byte, 2us);
    EXPECT_EQ(sim.costs.uart_per_byte, 1us);
    EXPECT_EQ(sim.costs.nic_per_byte, 10ns);
    EXPECT_EQ(sim.costs.context_switch, 1500ns);

    ASSERT_EQ(sim.interrupts.size(), 2u);
    EXPECT_EQ(sim.interrupts[0].device, DeviceClass::nic);
    EXPECT_EQ(sim.interrupts[0].rate_hz, 2000);
    EXPECT_EQ(sim.interrupts[0].arrival, Arrival::poisson);
    EXPECT_EQ(sim.interrupts[0].core, 0);
    EXPECT_EQ(sim.interrupts[0].top_half, 4us);
    EXPECT_EQ(sim.interrupts[0].bottom_half, 30us);
    EXPECT_EQ(sim.interrupts[1].device, DeviceClass::i2c);
    EXPECT_EQ(sim.interrupts[1].arrival, Arrival::periodic);
    EXPECT_EQ(sim.interrupts[1].core, 3);
    EXPECT_EQ(sim.interrupts[1].from, kEpoch + 1s);
    EXPECT_EQ(sim.interrupts[1].lost_from, kEpoch + 10s);
    EXPECT_EQ(sim.interrupts[1].stuck_from, kEpoch + 5s);
    EXPECT_EQ(sim.interrupts[1].stuck_rate_hz, 50000);

    ASSERT_EQ(sim.loop_faults.size(), 1u);
    EXPECT_EQ(sim.loop_faults[0].loop, 1);
    EXPECT_EQ(sim.loop_faults[0].extra, 5ms);
    EXPECT_EQ(sim.loop_faults[0].from, kEpoch + 2s);
    EXPECT_EQ(sim.loop_faults[0].until, kEpoch + 3s);
    ASSERT_EQ(sim.stuck_pins.size(), 1u);
    EXPECT_EQ(sim.stuck_pins[0].pin.number, 5);
    EXPECT_EQ(sim.stuck_pins[0].level, Level::high);
    EXPECT_EQ(sim.stuck_pins[0].from, kEpoch + 4s);
    EXPECT_EQ(sim.stuck_pins[0].until, kForever);
    ASSERT_EQ(sim.silent_chips.size(), 1u);
    EXPECT_EQ(sim.silent_chips[0].bus.number, 0);
    EXPECT_EQ(sim.silent_chips[0].address.value, 0x48);
    EXPECT_EQ(sim.silent_chips[0].until, kEpoch + 8s);
}

TEST(BoardFile, TheExampleOfThePageSaysEverythingThatCanBeSaidOfLinux) {
    const ReadBoardFile read = parse_board(example_of("board-file.md"), "docs/board-file.md");
    ASSERT_TRUE(read.ok()) << read.error;
    const board::linux::LinuxConfig& config = read.board.linux;
    EXPECT_EQ(config.pins_path, "/dev/shm/qduino/pins");
    EXPECT_FALSE(config.real_time);
    EXPECT_FALSE(config.lock_memory);
    EXPECT_FALSE(config.enforce_budgets);
    EXPECT_EQ(config.priority_highest, 70);
    EXPECT_EQ(config.priority_lowest, 30);
    EXPECT_EQ(config.stack_bytes, 524288u);
    EXPECT_FALSE(config.handle_signals);
    EXPECT_EQ(config.heartbeat_bound, 300ms);
    EXPECT_EQ(config.setup_bound, 20s);
    EXPECT_TRUE(config.isolate);
    EXPECT_FALSE(config.lift_throttling);
    EXPECT_EQ(config.settings_state, "/run/qduino/settings.state");
    EXPECT_EQ(config.probe_duration, 50ms);

    ASSERT_EQ(config.gpio.size(), 2u);
    EXPECT_EQ(config.gpio[1].pin.number, 6);
    EXPECT_EQ(config.gpio[1].chip, 1u);
    EXPECT_EQ(config.gpio[1].line, 27u);
    ASSERT_EQ(config.pwm.size(), 1u);
    EXPECT_EQ(config.pwm[0].pin.number, 9);
    EXPECT_EQ(config.pwm[0].chip, 2u);
    EXPECT_EQ(config.pwm[0].channel, 1u);
    EXPECT_EQ(config.pwm[0].period, 20ms);
    ASSERT_EQ(config.analog.size(), 1u);
    EXPECT_EQ(config.analog[0].pin.number, 54);
    EXPECT_EQ(config.analog[0].device, 3u);
    EXPECT_EQ(config.analog[0].channel, 2u);
    EXPECT_EQ(config.analog[0].full_scale, 1023);
    ASSERT_EQ(config.i2c.size(), 1u);
    EXPECT_EQ(config.i2c[0].bus.number, 1);
    EXPECT_EQ(config.i2c[0].adapter, 4u);
    ASSERT_EQ(config.spi.size(), 1u);
    EXPECT_EQ(config.spi[0].bus.number, 1);
    EXPECT_EQ(config.spi[0].controller, 5u);
    EXPECT_EQ(config.spi[0].chip_select, 2u);
}

TEST(BoardFile, TheExampleOfThePageSaysEverythingThatCanBeSaidOfParts) {
    const ReadBoardFile read = parse_board(example_of("board-file.md"), "docs/board-file.md");
    ASSERT_TRUE(read.ok()) << read.error;
    ASSERT_EQ(read.board.parts.size(), 5u);
    const PartSpec& cell = read.board.parts[0];
    EXPECT_EQ(cell.chip, Chip::hx711);
    EXPECT_EQ(cell.data.number, 2);
    EXPECT_EQ(cell.clock.number, 3);
    EXPECT_EQ(cell.value, -12345);
    EXPECT_EQ(cell.value_b, 678);
    const PartSpec& thermometer = read.board.parts[1];
    EXPECT_EQ(thermometer.chip, Chip::ds18b20);
    EXPECT_EQ(thermometer.data.number, 4);
    EXPECT_EQ(thermometer.serial, 0x5A3B2C1u);
    EXPECT_EQ(thermometer.celsius, 21.5);
    const PartSpec& display = read.board.parts[2];
    EXPECT_EQ(display.chip, Chip::ssd1306);
    EXPECT_EQ(display.bus.number, 1);
    EXPECT_EQ(display.address.value, 0x3D);
    EXPECT_EQ(display.height, 32);
    EXPECT_EQ(display.picture, "screen.pbm");
    EXPECT_EQ(read.board.parts[3].chip, Chip::ws2812);
    EXPECT_EQ(read.board.parts[3].data.number, 6);
    EXPECT_EQ(read.board.parts[3].pixels, 30);
    const PartSpec& receiver = read.board.parts[4];
    EXPECT_EQ(receiver.chip, Chip::ir);
    EXPECT_EQ(receiver.data.number, 7);
    EXPECT_EQ(receiver.light.led.number, 8);
    EXPECT_EQ(receiver.light.at, kEpoch + 500ms);
    EXPECT_EQ(receiver.light.remote, 4);
    EXPECT_EQ(receiver.light.command, 24);
    EXPECT_EQ(receiver.light.repeats, 2);
}

TEST(BoardFile, PartsHaveTheirOwnKeysAndDoNotShareWires) {
    const std::string cell = "[[part]]\nchip = \"hx711\"\ndata = 2\nclock = 3\n";
    const std::string thermometer = "[[part]]\nchip = \"ds18b20\"\ndata = 4\n";
    const std::string display = "[[part]]\nchip = \"ssd1306\"\n";
    EXPECT_EQ(error_of(cell + thermometer + thermometer + "serial = 2\n" + display + display + "bus = 1\n"),
              "");
    EXPECT_EQ(error_of("[[part]]\nchip = \"hx711\"\ndata = 2\n"), "b.toml:1: [[part]] needs 'clock'");
    EXPECT_EQ(error_of("[[part]]\ndata = 2\n"), "b.toml:1: [[part]] needs 'chip'");
    EXPECT_EQ(error_of(cell + "celsius = 3.0\n"),
              "b.toml:5: [[part]] 'celsius' is not known; accepted: chip, data, clock, value, value_b");
    EXPECT_EQ(error_of(display + "height = 48\n"), "b.toml:3: [[part]] 'height' is neither 32 nor 64");
    EXPECT_EQ(error_of("[[part]]\nchip = \"hx711\"\ndata = 2\nclock = 2\n"),
              "b.toml:4: [[part]] 'clock' is the pin of 'data'");
    EXPECT_EQ(error_of(thermometer + "[[part]]\nchip = \"ws2812\"\ndata = 4\n"),
              "b.toml:6: [[part]] 'data' is that of another part");
    EXPECT_EQ(error_of(thermometer + thermometer), "b.toml:4: [[part]] 'serial' is that of another part");
    EXPECT_EQ(error_of(display + display), "b.toml:3: [[part]] 'address' is that of another part");
    EXPECT_EQ(error_of(cell + "[[part]]\nchip = \"ds18b20\"\ndata = 3\n"),
              "b.toml:7: [[part]] 'data' is that of another part");
    EXPECT_EQ(error_of(thermometer + "[[part]]\nchip = \"hx711\"\ndata = 5\nclock = 4\n"),
              "b.toml:7: [[part]] 'clock' is that of another part");
    EXPECT_EQ(error_of(cell + "[[part]]\nchip = \"hx711\"\ndata = 3\nclock = 7\n"),
              "b.toml:7: [[part]] 'data' is that of another part");
}

TEST(BoardFile, ErrorsNameFileLineKeyAndWhatIsAccepted) {
    EXPECT_EQ(error_of("\n[sim]\ncores = 0\n"),
              "b.toml:3: [sim] 'cores' is 0; accepted: a whole number from 1 to 64");
    EXPECT_EQ(error_of("[sim]\ncores = 1.5\n"),
              "b.toml:2: [sim] 'cores' is 1.5; accepted: a whole number from 1 to 64");
    EXPECT_EQ(
        error_of("[sim]\ntick_period = 4\n"),
        "b.toml:2: [sim] 'tick_period' is 4; accepted: a duration in quotes with its unit, such as \"4 ms\" "
        "(ns, us, ms, s, min or h)");
    EXPECT_EQ(error_of("[sim]\nbody_cost = \"0 ns\"\n"),
              "b.toml:2: [sim] 'body_cost' is '0 ns'; accepted: a duration in quotes with its unit, such as "
              "\"4 ms\" "
              "(ns, us, ms, s, min or h), at least 1 ns");
    EXPECT_EQ(
        error_of("[[sim.interrupt]]\ndevice = \"usb\"\nrate_hz = 1\n"),
        "b.toml:2: [[sim.interrupt]] 'device' is 'usb'; accepted: \"gpio\", \"i2c\", \"spi\", \"uart\", "
        "\"nic\", \"disk\"");
    EXPECT_EQ(error_of("[linux]\nisolate = \"yes\"\n"),
              "b.toml:2: [linux] 'isolate' is 'yes'; accepted: true or false");
    EXPECT_EQ(error_of("[linux]\npins = 3\n"), "b.toml:2: [linux] 'pins' is 3; accepted: a text in quotes");
    EXPECT_EQ(error_of("[[sim.interrupt]]\ndevice = \"nic\"\nrate_hz = 0\n"),
              "b.toml:3: [[sim.interrupt]] 'rate_hz' is 0; accepted: a number from 0.001 to 100000000");
    EXPECT_EQ(error_of("sim = 3\n"), "b.toml:1: 'sim' is 3; accepted: a table, [sim]");
    EXPECT_EQ(error_of("[gpio]\npin = 1\n"),
              "b.toml:1: 'gpio' is a table; accepted: tables, each begun with [[gpio]]");
    EXPECT_EQ(error_of("[sim\n").rfind("b.toml:1: ", 0), 0u);
}

TEST(BoardFile, UnknownKeysAreErrorsThatListTheKnownOnes) {
    EXPECT_EQ(
        error_of("[sim]\nseeed = 1\n"),
        "b.toml:2: [sim] 'seeed' is not known; accepted: cores, seed, tick_period, tick_cost, wake_latency, "
        "edge_top_half, edge_interval, charge_interrupts_to_victim, serial_at_baud, edge_poll_period, "
        "poll_limit, poll_cost, "
        "body_cost, "
        "spin_limit, stack_bytes, costs, interrupt, fault");
    EXPECT_EQ(error_of("[[gpio]]\npin = 1\nline = 2\npull = \"up\"\n"),
              "b.toml:4: [[gpio]] 'pull' is not known; accepted: pin, chip, line");
    EXPECT_EQ(error_of("[[sim.fault.motor]]\npin = 1\n"),
              "b.toml:1: [sim.fault] 'motor' is not known; accepted: loop, pin, chip");
    EXPECT_EQ(error_of("cores = 2\n"),
              "b.toml:1: 'cores' is not known; accepted: sim, linux, gpio, pwm, analog, i2c, spi, part");
}

TEST(BoardFile, WhatATableNeedsIsAskedFor) {
    EXPECT_EQ(error_of("\n[[gpio]]\npin = 1\n"), "b.toml:2: [[gpio]] needs 'line'");
    EXPECT_EQ(error_of("[[sim.interrupt]]\ndevice = \"nic\"\n"),
              "b.toml:1: [[sim.interrupt]] needs 'rate_hz'");
    EXPECT_EQ(error_of("[[sim.fault.pin]]\npin = 3\n"), "b.toml:1: [[sim.fault.pin]] needs 'level'");
    EXPECT_EQ(error_of("[[i2c]]\nbus = 0\n"), "b.toml:1: [[i2c]] needs 'adapter'");
}

TEST(BoardFile, RulesBetweenKeysAreKept) {
    EXPECT_EQ(error_of("[[sim.interrupt]]\ndevice = \"nic\"\nrate_hz = 1\ncore = 2\n"),
              "b.toml:4: [[sim.interrupt]] 'core' is 2; accepted: 0 to 1 ([sim] cores is 2)");
    EXPECT_EQ(error_of("[sim]\ntick_cost = \"1 us\"\n"),
              "b.toml:2: [sim] 'tick_cost' leaves nothing of 'tick_period'");
    EXPECT_EQ(error_of("[[sim.fault.loop]]\nloop = 1\nextra = \"1 ms\"\nfrom = \"2 s\"\nuntil = \"1 s\"\n"),
              "b.toml:5: [[sim.fault.loop]] 'until' is not after 'from'");
    EXPECT_EQ(error_of("[linux]\npriority_highest = 20\n"),
              "b.toml:1: [linux] 'priority_lowest' is above 'priority_highest' (20)");
    EXPECT_EQ(error_of("[[gpio]]\npin = 1\nline = 2\n[[pwm]]\npin = 1\nchannel = 0\n"),
              "b.toml:5: [[pwm]] 'pin' is 1, which has a device already");
    EXPECT_EQ(error_of("[[i2c]]\nadapter = 1\n[[i2c]]\nadapter = 2\n"),
              "b.toml:3: [[i2c]] 'bus' is 0, which has a device already");
}

TEST(BoardFile, TheFirstErrorIsTheOneThatIsSaid) {
    EXPECT_EQ(error_of("[sim]\ncores = 99\nseed = \"x\"\n"),
              "b.toml:2: [sim] 'cores' is 99; accepted: a whole number from 1 to 64");
}

TEST(BoardFile, FewerCoresThanTheFileCountsOnAreFound) {
    ReadBoardFile read =
        parse_board("[sim]\ncores = 4\n[[sim.interrupt]]\ndevice = \"nic\"\nrate_hz = 1\ncore = 3\n", "b");
    ASSERT_TRUE(read.ok()) << read.error;
    EXPECT_EQ(why_cores_do_not_fit(read.board.sim), "");
    read.board.sim.cores = 2;
    EXPECT_EQ(why_cores_do_not_fit(read.board.sim),
              "an interrupt source of the board is on core 3, but there are only 2 cores");
}

TEST(BoardFile, AFileThatCannotBeReadIsNamed) {
    EXPECT_NE(read_board_file("/nonexistent/b.toml").error.find("/nonexistent/b.toml"), std::string::npos);
    EXPECT_NE(read_board_file("/").error.find("cannot be read"), std::string::npos);
}

}  // namespace
}  // namespace qduino::apps::board_file_test
