// Runs one sketch, a shared object made of its .ino, on the fake board of tests/unit/arduino for
// ten seconds of virtual time.
//
//   example_runner SKETCH.so Serial is standard input and output; stderr has a summary of pins
//
// Inputs of the fake world: every pin toggles each 0.7 s; every analog input is a slow ramp. The
// program ends when the virtual time is over. A sketch that ends in an empty `while (true)` ends
// when it has used half a second of CPU.
#include <dlfcn.h>
#include <sys/time.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "arduino/HardwareSerial.h"
#include "runtime/runtime.h"
#include "tests/fake/fake_board.h"

namespace {

using qduino::Instant;
using qduino::fake::state;

constexpr Instant kEnd{std::chrono::seconds{10}};
constexpr qduino::Nanoseconds kPassCost{50'000};  // of a body that lets no time pass

/// Thrown through the sketch when its time is over.
struct TimeIsOver {};

void end_when_over() {
    if (state().now >= kEnd) throw TimeIsOver{};
}

int input_level(int pin, Instant now) {
    end_when_over();
    return (qduino::to_ns(now) / 700'000'000 + pin) % 2 == 0 ? 0 : 1;
}

double input_voltage(int pin) {
    end_when_over();
    const double seconds = static_cast<double>(qduino::to_ns(state().now)) * 1e-9;
    return 0.1 * (pin % 4) + 0.06 * seconds;
}

void prepare_board() {
    qduino::fake::reset();
    state().look_cost = qduino::Nanoseconds{200};
    state().level_of = input_level;
    state().analog_of = input_voltage;
    state().while_sleeping = end_when_over;
}

/// One line for each pin that was driven: how often it changed, and its PWM.
void report() {
    std::map<int, int> changes;
    std::map<int, int> level;
    std::map<int, int> duties;
    for (const auto& event : state().writes) {
        changes[event.pin] += level[event.pin] != event.level ? 1 : 0;
        level[event.pin] = event.level;
    }
    for (const auto& event : state().pwm) ++duties[event.pin];
    for (const auto& [pin, count] : changes) std::fprintf(stderr, "pin %d changed %d\n", pin, count);
    for (const auto& [pin, count] : duties) std::fprintf(stderr, "pin %d pwm %d\n", pin, count);
}

void run_sketch() {
    const qduino::runtime::Runtime runtime{qduino::fake::board()};
    auto& table = qduino::runtime::sketch_table();
    if (table.setup) table.setup();
    while (true) {
        for (const auto& loop : table.loops) {
            state().vcpu = loop.id;
            loop.body();
        }
        state().now += kPassCost;
        end_when_over();
    }
}

/// The sketch spins for ever without a call, as some examples do at their end. Output is flushed by
/// hand: the sketch holds no lock.
void end_of_cpu_time(int) {
    Serial.flush();
    std::fprintf(stderr, "still running\n");
    _exit(0);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) return 2;
    prepare_board();
    if (!dlopen(argv[1], RTLD_NOW | RTLD_GLOBAL)) {
        std::fprintf(stderr, "%s\n", dlerror());
        return 1;
    }
    std::signal(SIGVTALRM, end_of_cpu_time);
    const itimerval cpu_time{{0, 0}, {0, 500'000}};
    setitimer(ITIMER_VIRTUAL, &cpu_time, nullptr);
    try {
        run_sketch();
    } catch (const TimeIsOver&) {
    }
    Serial.flush();
    report();
    return 0;
}
