// bench-motion [--json] [--moves N]: how fast moves are planned and solved into steps, and steps
// played, on one core.
//
// There are four loads. `tiny`: 0.02 mm moves, hardly anything but planning, with the queue always
// full. `curves`: 0.5 mm moves around a circle, extruding, as in a detailed print. `infill`: 10 mm
// zigzag, many steps a move. `travel`: across the bed and back, hardly anything but steps. Each
// runs planner, solver and a sink that adds up its events: loop 1 without the parser and the ring.
// `play` is the player alone, from the ring to pins that only count, on a clock that jumps.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string_view>

#include "channel/ring_buffer.h"
#include "printer/motion/planner.h"
#include "printer/step/player.h"
#include "printer/step/solver.h"

namespace {

using namespace qduino::printer;
using motion::Move;

struct Load {
    const char* name;
    Move (*move_at)(std::size_t number);
    std::size_t share;  // one move of so many of --moves: long moves take longer
};

Move circle_at(std::size_t number, double length_mm) {
    const double angle = static_cast<double>(number) * length_mm / 20.0;
    return {{75 + 20 * std::cos(angle), 75 + 20 * std::sin(angle), 0.2}, 0.0332 * length_mm, 60, 3000};
}

Move tiny_at(std::size_t number) { return circle_at(number, 0.02); }

Move curve_at(std::size_t number) { return circle_at(number, 0.5); }

Move infill_at(std::size_t number) {
    const double y = 20 + 0.45 * static_cast<double>(number / 2 % 200);
    const double x = (number / 2 + number) % 2 == 0 ? 60.0 : 70.0;
    return {{x, y, 0.2}, 0.3, 100, 3000};
}

Move travel_at(std::size_t number) {
    const double place = number % 2 == 0 ? 10.0 : 140.0;
    return {{place, place, 0.2}, 0, 125, 3000};
}

struct Outcome {
    std::size_t moves = 0;
    std::uint64_t steps = 0;
    double wall_s = 0;
    std::int64_t checksum = 0;  // keeps the compiler from leaving the work out
};

double seconds_since(std::chrono::steady_clock::time_point begin) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

Outcome run(const Load& load, std::size_t moves) {
    const MachineConfig config;
    const auto planner = std::make_unique<motion::Planner>(motion::motion_settings(config),
                                                           motion::AxisVector{75, 75, 0.2, 0});
    step::Solver solver{motion::motion_settings(config), {75, 75, 0.2, 0}};
    Outcome outcome;
    const auto sink = [&](const step::StepEvent& event) {
        outcome.checksum ^= event.time_ns;
        outcome.steps += event.kind == step::EventKind::step;
    };
    const auto begin = std::chrono::steady_clock::now();
    std::size_t appended = 0;
    motion::Segment segment;
    while (true) {
        while (appended < moves && planner->append(load.move_at(appended))) ++appended;
        if (appended == moves) planner->flush();
        if (!planner->next(segment)) break;
        do {
            solver.load(segment);
            solver.solve_some(~std::size_t{0}, sink);
        } while (planner->next(segment));
    }
    solver.drain();
    solver.solve_some(~std::size_t{0}, sink);
    outcome.wall_s = seconds_since(begin);
    outcome.moves = moves;
    return outcome;
}

/// Pins that count, on a clock that jumps to the instant that is waited for.
struct CountingPins {
    std::int64_t now_ns = 0;
    std::int64_t edges = 0;
    [[nodiscard]] qduino::Instant now() const { return qduino::instant_from_ns(now_ns); }
    void busy_until(qduino::Instant t) { now_ns = std::max(now_ns, qduino::to_ns(t)); }
    void set_steps(const step::MotorList& motors, bool) { edges += static_cast<std::int64_t>(motors.size()); }
    void set_direction(int, bool) { ++edges; }
    [[nodiscard]] bool endstop_pressed(int) const { return false; }
    void watch_switches(int, bool) const {}
};

/// Steps of three axes at 10, 9 and 1 kHz, turning back every 1000 steps, in calls of 100 µs as
/// loop 2 makes them.
Outcome play(std::size_t steps) {
    using Ring = qduino::channel::RingBuffer<step::StepEvent, step::kStepRingCapacity>;
    const auto ring = std::make_unique<Ring>();
    CountingPins pins;
    step::Player<CountingPins, Ring> player(pins, *ring);
    const std::int64_t periods_ns[] = {100'000, 111'111, 1'000'000};
    std::int64_t due_ns[] = {0, 0, 0};
    std::uint32_t made[] = {0, 0, 0};
    Outcome outcome;
    while (outcome.steps < steps) {
        while (ring->free() > 0) {
            const int axis =
                due_ns[1] < due_ns[0] ? (due_ns[2] < due_ns[1] ? 2 : 1) : (due_ns[2] < due_ns[0] ? 2 : 0);
            const auto direction = static_cast<std::int8_t>(made[axis]++ / 1000 % 2 ? -1 : 1);
            (void)ring->try_push(
                {due_ns[axis], step::EventKind::step, static_cast<std::uint8_t>(axis), direction, 0, 0});
            due_ns[axis] += periods_ns[axis];
        }
        outcome.steps += ring->size();
        const auto begin = std::chrono::steady_clock::now();
        while (!ring->empty()) player.play_until(qduino::instant_from_ns(pins.now_ns += 100'000));
        outcome.wall_s += seconds_since(begin);
    }
    outcome.checksum = pins.edges;
    return outcome;
}

void print(const char* name, const Outcome& out, bool json, bool first) {
    const double moves_per_s = static_cast<double>(out.moves) / out.wall_s;
    const double steps_per_s = static_cast<double>(out.steps) / out.wall_s;
    const auto steps = static_cast<unsigned long long>(out.steps);
    if (json) {
        std::printf(
            "%s{\"load\":\"%s\",\"moves\":%zu,\"steps\":%llu,\"wall_s\":%.4f,\"moves_per_s\":%.0f,"
            "\"steps_per_s\":%.0f}",
            first ? "" : ",", name, out.moves, steps, out.wall_s, moves_per_s, steps_per_s);
    } else {
        std::printf("%-8s %9zu moves %10llu steps %7.3f s  %9.0f moves/s %10.0f steps/s  (check %llx)\n",
                    name, out.moves, steps, out.wall_s, moves_per_s, steps_per_s,
                    static_cast<unsigned long long>(out.checksum));
    }
}

}  // namespace

int main(int argc, char** argv) {
    bool json = false;
    std::size_t moves = 1'000'000;
    for (int i = 1; i < argc; ++i) {
        if (std::string_view(argv[i]) == "--json") {
            json = true;
        } else if (std::string_view(argv[i]) == "--moves" && i + 1 < argc) {
            moves = std::strtoull(argv[++i], nullptr, 10);
        } else {
            std::fprintf(stderr, "usage: bench-motion [--json] [--moves N]\n");
            return 2;
        }
    }
    const Load loads[] = {
        {"tiny", tiny_at, 1}, {"curves", curve_at, 1}, {"infill", infill_at, 10}, {"travel", travel_at, 200}};
    if (json) std::printf("{\"results\":[");
    for (const Load& load : loads) {
        print(load.name, run(load, std::max<std::size_t>(1, moves / load.share)), json, &load == loads);
    }
    print("play", play(15 * moves), json, false);
    if (json) std::printf("]}\n");
    return 0;
}
