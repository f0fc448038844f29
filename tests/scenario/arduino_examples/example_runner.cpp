// Runs one sketch, a shared object made of its .ino, in the simulator for ten seconds of virtual
// time.
//
//   example_runner SKETCH.so Serial is standard input and output; stderr has a summary of pins
//
// Inputs of its world: every pin toggles each 0.7 s; every analog input is a slow ramp. What ends
// the run is the time, also where the sketch spins or its setup() does not return: nothing here
// knows of that, the simulator alone does.
#include <dlfcn.h>

#include <cstdio>
#include <map>

#include "arduino/HardwareSerial.h"
#include "board/peripherals.h"
#include "board/sim/endless_jump.h"
#include "board/sim/sim_board.h"
#include "runtime/runtime.h"

namespace {

using namespace qduino;
using board::Level;
using board::PinId;

constexpr Instant kEnd = kEpoch + 10s;

class World final : public board::NoPeripherals {
  public:
    void pin_written(Instant, PinId pin, Level level) override {
        changes_[pin.number] += level_[pin.number] != level ? 1 : 0;
        level_[pin.number] = level;
    }
    void pwm_written(Instant, PinId pin, double) override { ++duties_[pin.number]; }
    Level pin_level(Instant now, PinId pin) override {
        return (to_ns(now) / 700'000'000 + pin.number) % 2 == 0 ? Level::low : Level::high;
    }
    double analog_level(Instant now, PinId pin) override {
        return 0.1 * (pin.number % 4) + 0.06 * to_seconds(now - kEpoch);
    }
    Result<void> i2c_transfer(Instant, board::I2cBus, board::I2cAddress, std::span<const std::uint8_t>,
                              std::span<std::uint8_t>) override {
        return {};
    }

    /// One line for each pin that was driven: how often it changed, and its PWM.
    void report() const {
        for (const auto& [pin, count] : changes_) std::fprintf(stderr, "pin %d changed %d\n", pin, count);
        for (const auto& [pin, count] : duties_) std::fprintf(stderr, "pin %d pwm %d\n", pin, count);
    }

  private:
    std::map<int, int> changes_;
    std::map<int, Level> level_;
    std::map<int, int> duties_;
};

/// A question to a pin, and a pass of loop(), cost about what they do on an AVR: most sketches ask
/// all the time.
board::sim::SimConfig computer() {
    board::sim::SimConfig config;
    config.poll_cost = 1us;
    config.body_cost = 50us;
    return config;
}

board::sim::SimBoard* in_setup = nullptr;  // a table's setup() has no argument
void (*sketch_setup)() = nullptr;

/// Returns how the run ended.
const char* run_sketch(board::sim::SimBoard& board) {
    const board::sim::EndlessJumps jumps(board.event_loop(), nullptr);
    runtime::Runtime runtime{board};
    runtime::SketchTable table = runtime::sketch_table();
    in_setup = &board;
    sketch_setup = table.setup;
    static bool ended = false;
    table.setup = [] { ended = in_setup->run_setup(sketch_setup, kEnd); };
    if (const Result<void> begun = runtime.begin(table); !begun) {
        const std::string_view why = begun.error().message;
        std::fprintf(stderr, "%.*s\n", static_cast<int>(why.size()), why.data());
        return nullptr;
    }
    if (!ended) return "setup() has not ended";
    runtime.run(kEnd);
    for (const board::sim::SpinSeen& seen : board.spins()) {
        if (seen.goes_on) return "it spins";
    }
    return "it goes on";
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) return 2;
    if (!dlopen(argv[1], RTLD_NOW | RTLD_GLOBAL)) {
        std::fprintf(stderr, "%s\n", dlerror());
        return 1;
    }
    World world;
    board::sim::SimBoard board(computer(), world);
    const char* const ended = run_sketch(board);
    Serial.settle(1000);
    world.report();
    if (!ended) return 1;
    std::fprintf(stderr, "%s\n", ended);
    return 0;
}
