// The sketch pins/ on the lines of /dev/gpiochip0 (pin N is line N), twice: by itself, and as a
// supervisor's child that is killed.
//
//   init ── test ──┬── 1. the sketch; it is stopped, and leaves the pins in their safe states
//                  └── 2. the supervisor ── "init PINS": the sketch; it is killed, and the
//                         supervisor takes its lines over
#include <cstdio>
#include <cstdlib>

#include "apps/supervisor/supervisor.h"
#include "tests/emulated/guest/guest_init.h"
#include "tests/emulated/guest/run_sketch.h"

namespace {

using namespace qduino;

constexpr const char* kPins = "/run/pins";

int run_pins(const char* pins) {
    board::linux::LinuxConfig config;
    config.pins_path = pins;
    for (std::uint16_t line = 0; line < 8; ++line) config.gpio.push_back({board::PinId{line}, 0, line});
    return emulated::run_sketch(std::move(config), std::chrono::seconds{120});
}

/// The status of a sketch that dies under the supervisor.
int run_supervised() {
    ::setenv("SKETCH_ENDS_BY_KILL", "1", 1);
    supervisor::Options options;
    options.pins = kPins;
    options.make_pins = true;
    options.heartbeat_timeout = Nanoseconds{0};  // an emulated core may be late at any time
    options.command = {"/init", kPins};
    supervisor::SystemCalls system;
    auto supervisor = supervisor::Supervisor::open(std::move(options), system);
    if (supervisor) return supervisor->run(-1);
    std::printf("emulated: %s\n", std::string{supervisor.error().message.view()}.c_str());
    return 2;
}

}  // namespace

int main(int count, char** arguments) {
    if (count == 2) return run_pins(arguments[1]);
    return emulated::run_as_init([] {
        const int stopped = run_pins("");
        std::printf("emulated: stopped sketch ended with %d\n", stopped);
        if (stopped != 0) return stopped;
        std::printf("emulated: killed sketch ended with %d\n", run_supervised());
        return 0;
    });
}
