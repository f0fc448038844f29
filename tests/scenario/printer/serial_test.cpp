// A serial host prints on the printer through a damaged wire, and the twin says what was built; an
// M112 in its bytes stops everything, however much waits in front of it.
#include <gtest/gtest.h>

#include <bitset>

#include "printer/gcode/emergency_scanner.h"
#include "printer/gcode/reports.h"
#include "serial/serial_session.h"
#include "tests/scenario/printer/printer_bench.h"
#include "tests/unit/serial/noisy_host.h"

namespace qduino::tests::serial_test {
namespace {

using link::MachineState;

/// A print service that has nothing but a serial port, in virtual time.
class SerialBench {
  public:
    bool begin(board::Peripherals* front = nullptr) {
        const bool ok = bench.begin(front);
        push({});  // a host begins
        learn();
        session.open();
        return ok;
    }
    /// What the host hears when it says `bytes`, and `seconds` go by.
    std::string exchange(std::string_view bytes, double seconds) {
        hear(bytes);
        bench.run(seconds);
        learn();
        session.tick(bench.now());
        return session.take_output();
    }
    void hear(std::string_view bytes) {
        if (scanner.feed(bytes).stop) bench.emergency();
        session.take(bytes, bench.now());
        for (const apps::HostLine& line : session.take_lines()) push(line.text);
    }
    [[nodiscard]] twin::Report report() { return bench.report(); }

    PrinterBench bench;
    apps::SerialSession session;
    printer::gcode::EmergencyScanner scanner;

  private:
    void push(std::string_view line) { bench.command(link::Command::host_line, line); }
    void learn() {
        for (const auto& [kind, text] : bench.take_host_replies()) session.hear(kind, text);
        const link::JobStatus status = bench.status();
        session.learn({.connected = true,
                       .session = 1,
                       .lines_over = status.host_lines,
                       .temperatures = "T:0",
                       .fault = status.state == MachineState::faulted ? bench.fault() : ""},
                      bench.now());
        for (const apps::HostLine& line : session.take_lines()) push(line.text);
    }
};

/// A hot part of short lines, with what slicers put between them. Ends when everything is still.
std::vector<std::string> part() {
    std::vector<std::string> lines{"M104 S200", "G28", "M109 S200", "G92 E0", "M82", "G1 X20 Y20 Z0.3 F6000"};
    for (int i = 0; i < 150; ++i) {
        const double angle = i * 0.1256;
        char line[80];
        std::snprintf(line, sizeof line, "G1 X%.3f Y%.3f E%.4f F1800", 60 + 25 * std::cos(angle),
                      60 + 25 * std::sin(angle), i * 0.06);
        lines.emplace_back(line);
        if (i % 20 == 0) lines.push_back("M106 S" + std::to_string(i));
        if (i % 50 == 49) lines.emplace_back("M114");
    }
    lines.insert(lines.end(), {"M104 S0", "M107", "M400"});
    return lines;
}

/// 4 s: longer than the printer is ever silent.
constexpr int kPatience = 200;

std::string joined(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) text += line + "\n";
    return text;
}

std::string first_difference(const twin::Report& report) {
    return report.differences.empty() ? "" : report.differences[0];
}

class SerialPrint : public testing::TestWithParam<double> {};

TEST_P(SerialPrint, IsThePartThatWasAskedForHoweverNoisyTheWire) {
    const std::vector<std::string> lines = part();
    SerialBench serial;
    ASSERT_TRUE(serial.begin());
    serial.bench.watch(joined(lines));
    PingPongHost host{lines, kPatience};
    NoisyWire to_printer{1, GetParam()}, to_host{2, GetParam()};
    host.hear(serial.session.take_output());
    std::string errors;
    const auto over = [&] { return serial.bench.status().host_lines >= lines.size(); };
    for (int i = 0; i < 60'000 && !over(); ++i) {
        const std::string heard = serial.exchange(to_printer.carry(host.speak()), 0.02);
        if (heard.find("Error:") != std::string::npos) errors += heard;
        host.hear(to_host.carry_lines(heard));
    }
    ASSERT_TRUE(over()) << serial.bench.status().host_lines << " of " << lines.size() << "\n" << errors;
    EXPECT_EQ(errors.empty(), GetParam() == 0) << errors;
    const twin::Report report = serial.report();
    EXPECT_TRUE(report.matches) << first_difference(report);
    EXPECT_EQ(serial.bench.heat().fan_duty, 0.0);
}
INSTANTIATE_TEST_SUITE_P(Noise, SerialPrint, testing::Values(0.0, 0.1));

TEST(SerialPrintSkipped, ALineThatIsLeftOutIsNoMatch) {
    std::vector<std::string> lines = part();
    SerialBench serial;
    ASSERT_TRUE(serial.begin());
    serial.bench.watch(joined(lines));
    lines.erase(lines.begin() + 60);
    PingPongHost host{lines, kPatience};
    host.hear(serial.session.take_output());
    for (int i = 0; i < 60'000 && serial.bench.status().host_lines < lines.size(); ++i)
        host.hear(serial.exchange(host.speak(), 0.02));
    EXPECT_FALSE(serial.report().matches);
}

TEST(SerialHost, OkOfM400ComesWhenEverythingIsStill) {
    SerialBench serial;
    ASSERT_TRUE(serial.begin());
    EXPECT_EQ(serial.exchange("G28\n", 0), "start\n");
    std::string heard;
    for (int i = 0; i < 600 && heard.find("ok") == std::string::npos; ++i) heard += serial.exchange("", 0.1);
    EXPECT_NE(heard.find("echo:busy: processing\n"), std::string::npos) << heard;
    EXPECT_TRUE(serial.bench.status().homed[2]) << heard;
    EXPECT_EQ(serial.exchange("G1 X50 F1200\n", 0), "ok\n");
    EXPECT_EQ(serial.exchange("M400\n", 1), "");
    heard.clear();
    for (int i = 0; i < 100 && heard.find("ok") == std::string::npos; ++i) heard += serial.exchange("", 0.05);
    EXPECT_NEAR(serial.bench.metal().position_mm[0], 50, 0.02) << heard;
    EXPECT_FALSE(serial.bench.motion().moving);
    heard = serial.exchange("M114\n", 0.2);
    EXPECT_TRUE(heard.starts_with("X:50.00 Y:0.00 Z:0.00 E:0.00 Count X:4000 ")) << heard;
    EXPECT_TRUE(heard.ends_with("\nok\n")) << heard;
}

TEST(SerialHost, M410StopsTheMovesAndM108EndsAWait) {
    SerialBench serial;
    ASSERT_TRUE(serial.begin());
    serial.exchange("G28\n", 60);
    serial.exchange("G1 X100 F1200\nG1 X0\nG1 X100\n", 1);
    serial.session.send_at_once("M410");
    serial.exchange("", 0.3);
    const auto stopped = serial.bench.metal().position_steps;
    EXPECT_GT(stopped[0], 800);
    serial.bench.run(3);
    EXPECT_EQ(serial.bench.metal().position_steps, stopped);
    EXPECT_EQ(serial.bench.status().state, MachineState::idle) << "no fault";
    serial.exchange("M109 S200\n", 2);
    EXPECT_TRUE(serial.session.under_way() > 0);
    serial.session.send_at_once("M108");
    serial.exchange("", 0.3);
    EXPECT_EQ(serial.bench.heat().hot_end.target_celsius, 200) << "the heat stays";
    const std::string heard = serial.exchange("M114\n", 0.3);
    EXPECT_NE(heard.find("X:"), std::string::npos) << heard;
}

TEST(SerialHost, M0WaitsForM108) {
    SerialBench serial;
    ASSERT_TRUE(serial.begin());
    serial.exchange("G28\n", 60);
    EXPECT_EQ(serial.exchange("M0\n", 5).find("ok"), std::string::npos);
    serial.session.send_at_once("M108");
    EXPECT_EQ(serial.exchange("", 0.3), "ok\n");
}

TEST(SerialHost, ALineThatBreaksARuleIsAnErrorAndTheNextIsDone) {
    SerialBench serial;
    ASSERT_TRUE(serial.begin());
    serial.exchange("G28\n", 60);
    const std::string heard = serial.exchange("G1 X9000 F1200\nG1 X10\nM400\n", 3);
    EXPECT_NE(heard.find("Error:line 1, G1: X"), std::string::npos) << heard;
    EXPECT_NEAR(serial.bench.metal().position_mm[0], 10, 0.02);
}

TEST(SerialHost, WhileAJobRunsItMayAskButNotMove) {
    SerialBench serial;
    ASSERT_TRUE(serial.begin());
    serial.bench.job("G28\nG4 S30\nG1 X10 F1200\n");
    serial.bench.run(3);
    const std::string heard = serial.exchange("M114\n", 0.3);
    EXPECT_TRUE(heard.find("X:") != std::string::npos && heard.ends_with("ok\n")) << heard;
    EXPECT_NE(serial.exchange("G1 X50\n", 0.3).find("Error:G1 was not done: a job runs"), std::string::npos);
    ASSERT_TRUE(serial.bench.finish_job());
    EXPECT_EQ(serial.bench.status().outcome, link::JobOutcome::completed) << serial.bench.fault();
    EXPECT_TRUE(serial.report().matches);
}

/// Sees the last instant at which anything happened on the metal.
class LastEdge final : public board::ForwardingPeripherals {
  public:
    void pin_written(Instant now, board::PinId pin, board::Level level) override {
        if (steps_.test(pin.number) && level == board::Level::high) last_step = now;
        ForwardingPeripherals::pin_written(now, pin, level);
    }
    void pwm_written(Instant now, board::PinId pin, double duty) override {
        const bool was_on = std::exchange(on_[pin.number], duty > 0);
        if (was_on && duty == 0) last_off = now;
        ForwardingPeripherals::pwm_written(now, pin, duty);
    }
    void watch(const printer::MachineConfig& config) {
        for (const auto& axis : config.axes) steps_.set(axis.step_pin);
    }
    Instant last_step{}, last_off{};

  private:
    std::bitset<board::kPinCount> steps_;
    std::array<bool, board::kPinCount> on_{};
};

class SerialM112 : public testing::TestWithParam<int> {};

TEST_P(SerialM112, StopsWithinTenMillisecondsOfItsLastByteBehindAFullQueue) {
    std::mt19937_64 random{static_cast<std::uint64_t>(GetParam())};
    LastEdge pins;
    SerialBench serial;
    pins.forward_to(serial.bench.twin());
    pins.watch(serial.bench.printer().config());
    ASSERT_TRUE(serial.begin(&pins));
    serial.exchange("M104 S200\nG28\n", 60);
    std::string flood;
    for (int i = 0; i < 1000; ++i) flood += i % 2 == 0 ? "G1 X90.5 Y20 F6000\n" : "G1 X20 Y90.5\n";
    serial.exchange(flood, 2 + static_cast<double>(random() % 3000) / 1000);
    ASSERT_EQ(serial.session.under_way(), link::kHostLinesMax) << "the queue is full";
    serial.hear("M11");
    serial.bench.printer().run(serial.bench.now() +
                               Nanoseconds{static_cast<std::int64_t>(random() % 100'000'000)});
    const Instant last_byte = serial.bench.now();
    EXPECT_LT(last_byte - pins.last_step, 1ms) << "it moves";
    serial.hear("2\n");
    serial.bench.run(2);
    EXPECT_LE(pins.last_step - last_byte, 10ms);
    // Loop 2's look, not loop 3's next sample.
    EXPECT_LE(pins.last_off - last_byte, 1ms);
    EXPECT_EQ(serial.bench.metal().heater_duty[twin::kHotEnd], 0.0);
    EXPECT_EQ(serial.bench.status().state, MachineState::faulted);
    const auto behind_ms = [&](Instant last) { return std::max(0.0, to_seconds(last - last_byte) * 1e3); };
    std::printf("  seed %d: motion stops %.3f ms behind the last byte of M112, the heat %.3f ms\n",
                GetParam(), behind_ms(pins.last_step), behind_ms(pins.last_off));
}
INSTANTIATE_TEST_SUITE_P(Moments, SerialM112, testing::Range(1, 6));

}  // namespace
}  // namespace qduino::tests::serial_test
