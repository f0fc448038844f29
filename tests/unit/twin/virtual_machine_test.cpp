// The virtual machine over its real shared-memory pins, driven by the board's own writing side.
#include "apps/virtual_machine/virtual_machine.h"

#include <gtest/gtest.h>

#include <atomic>
#include <nlohmann/json.hpp>
#include <thread>

#include "board/linux/kernel/clock.h"
#include "board/linux/pin/virtual_pins.h"
#include "device/ads7828.h"
#include "inspect/inspect_server.h"
#include "tests/unit/twin/temporary_folder.h"

namespace qduino::apps::virtual_machine_test {
namespace {

using board::Level;
using board::PinId;
using board::linux::monotonic_now;
using board::linux::VirtualPins;
using nlohmann::json;
using twin::testing::TemporaryFolder;

constexpr board::VcpuId kLoop = 2;

/// A machine that runs in a thread, and a sketch's side of its pins.
class Plant {
  public:
    explicit Plant(const std::vector<twin::Fault>& faults = {}) : client_(folder / "inspect") {
        VirtualMachineOptions options;
        options.pins = pins_ / "pins";
        options.inspect = folder / "inspect";
        options.machine.axes[0].start_mm = 2;  // near its switch: homing takes little time
        options.faults = faults;
        auto made = VirtualMachine::create(options);
        if (!made) throw std::runtime_error(std::string(made.error().message.view()));
        machine_ = std::move(*made);
        thread_ = std::jthread([this] {
            while (!stop_) machine_->pass();
        });
        try {
            attach();
        } catch (...) {
            stop_ = true;  // or the thread would never be joined
            throw;
        }
    }
    ~Plant() { stop_ = true; }
    /// As a new sketch after the last one died.
    void attach() {
        sketch = std::make_unique<VirtualPins>();
        const Result<void> attached = sketch->attach(pins_ / "pins");
        if (!attached) throw std::runtime_error(std::string(attached.error().message.view()));
        if (!sketch->open_writer(kLoop, true)) throw std::runtime_error("no writer");
        // On a busy computer the machine may answer later than a sketch waits: then it asks again.
        const auto mode = [&](std::uint16_t pin, board::PinMode wanted) {
            Result<void> done = sketch->set_mode(kLoop, PinId{pin}, wanted);
            for (int i = 0; i < 100 && !done && done.error().code == ErrorCode::timed_out; ++i)
                done = sketch->set_mode(kLoop, PinId{pin}, wanted);
            if (!done) throw std::runtime_error(std::string(done.error().message.view()));
        };
        for (const std::uint16_t pin : {2, 3, 17}) mode(pin, board::PinMode::output);
        mode(5, board::PinMode::input);
    }
    static void pause(Nanoseconds duration) { board::linux::block_until(monotonic_now() + duration); }
    static void spin(Nanoseconds duration) {
        for (const Instant until = monotonic_now() + duration; monotonic_now() < until;) {
        }
    }
    void step_x(int direction, int count, Nanoseconds interval) {
        sketch->write(kLoop, PinId{3}, direction > 0 ? Level::high : Level::low);
        for (int i = 0; i < count; ++i) {
            spin(2us);
            sketch->write(kLoop, PinId{2}, Level::high);
            spin(2us);
            sketch->write(kLoop, PinId{2}, Level::low);
            spin(interval);
        }
    }
    [[nodiscard]] bool pressed() { return sketch->read(kLoop, PinId{5}) == Level::high; }
    json ask(const std::string& request) {
        const Result<std::string> answer = client_.ask(request, 10s);
        return answer ? json::parse(*answer) : json{{"error", std::string(answer.error().message.view())}};
    }

    TemporaryFolder folder;
    std::unique_ptr<VirtualPins> sketch;

  private:
    TemporaryFolder pins_{"/dev/shm"};
    InspectClient client_;
    std::unique_ptr<VirtualMachine> machine_;
    std::atomic<bool> stop_{false};
    std::jthread thread_;  // last: it ends before what it uses
};

TEST(VirtualMachine, StepsAndSwitchesCrossTheSharedPins) {
    Plant plant;
    EXPECT_FALSE(plant.pressed());
    plant.step_x(-1, 100, 100us);
    json state = plant.ask(R"({"op":"state"})");
    EXPECT_EQ(state.at("position_steps").at("x"), 60) << state;
    EXPECT_EQ(state.at("timing_violations"), 0);
    plant.step_x(-1, 61, 100us);
    for (int i = 0; i < 1000 && !plant.pressed(); ++i) Plant::pause(1ms);
    EXPECT_TRUE(plant.pressed());
    EXPECT_EQ(plant.ask(R"({"op":"state"})").at("position_steps").at("x"), -1);
}

TEST(VirtualMachine, TheConverterAnswersOverTheBus) {
    Plant plant;
    const std::array<std::uint8_t, 1> command{device::ads7828::command_byte(0)};
    std::array<std::uint8_t, 2> answer{};
    ASSERT_TRUE(
        plant.sketch->transfer(kLoop, board::I2cBus{1}, board::I2cAddress{0x48}, command, answer).ok());
    const auto celsius =
        device::Thermistor{}.celsius(device::ads7828::fraction(device::ads7828::decode(answer)));
    ASSERT_TRUE(celsius.ok());
    EXPECT_NEAR(celsius->value(), 20, 0.5);
    EXPECT_FALSE(
        plant.sketch->transfer(kLoop, board::I2cBus{1}, board::I2cAddress{0x49}, command, answer).ok());
}

TEST(VirtualMachine, AJobIsWatchedAcrossTheSocket) {
    Plant plant;
    const std::string path = plant.folder.write("job.gcode", "G1 X10\nG1 X8\n");
    EXPECT_TRUE(plant.ask(R"({"op":"job_begin","job":1,"path":")" + path + "\"}").at("ok"));
    plant.step_x(1, 800, 100us);
    plant.step_x(-1, 160, 100us);
    const json end = plant.ask(R"({"op":"job_end","job":1})");
    EXPECT_TRUE(end.at("report").at("matches")) << end;
    EXPECT_EQ(end.at("report").at("steps").at("x"), 960);
}

TEST(VirtualMachine, OutlivesTheSketch) {
    Plant plant;
    plant.step_x(1, 50, 100us);
    ASSERT_TRUE(plant.sketch->write_pwm(kLoop, PinId{17}, 0.5).ok());
    plant.sketch.reset();
    const json state = plant.ask(R"({"op":"state"})");
    EXPECT_EQ(state.at("position_steps").at("x"), 210);
    EXPECT_DOUBLE_EQ(state.at("hot_end").at("duty"), 0.5) << "a heater stays on until somebody turns it off";
    plant.attach();
    plant.step_x(1, 50, 100us);
    plant.sketch->write(kLoop, PinId{17}, Level::low);
    const json later = plant.ask(R"({"op":"state"})");
    EXPECT_EQ(later.at("position_steps").at("x"), 260);
    EXPECT_DOUBLE_EQ(later.at("hot_end").at("duty"), 0.0);
}

TEST(VirtualMachine, FaultsCountFromItsStart) {
    Plant plant({*twin::parse_fault("endstop_stuck_closed:x@0")});
    for (int i = 0; i < 1000 && !plant.pressed(); ++i) Plant::pause(1ms);
    EXPECT_TRUE(plant.pressed());
    EXPECT_FALSE(plant.ask(R"({"op":"state"})").at("endstops").at("x")) << "the switch itself is open";
}

}  // namespace
}  // namespace qduino::apps::virtual_machine_test
