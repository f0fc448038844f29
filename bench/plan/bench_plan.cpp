// bench-plan FILE [--machine M.toml] [--json]: from the bytes of a G-code file to step instants, on
// one core: how many lines, moves and steps a second.
//
//   bytes ─► reader ─► interpreter ─► planner ─► solver ─► step ring ─► popped and counted
//
// It is loop 1's path with its own parts (MotionPipe), as fast as it goes; a stand-in for loop 2
// takes every step off the ring at once. The same file is planned with each kind of motion: plain,
// with input shapers, with pressure advance, with a limited jerk, and with all of them. With
// --machine only as that file has it.
//
// Times are the thread's CPU time: other work on the core does not count. Memory is the most that
// the process ever had, the file in it.
#include <sys/resource.h>
#include <time.h>

#include <atomic>
#include <cmath>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bench/rig/report.h"
#include "config/machine_file.h"
#include "posix/small_file.h"
#include "printer/gcode/interpreter.h"
#include "printer/gcode/no_actions.h"
#include "printer/gcode/parser.h"
#include "printer/machine/motion_pipe.h"
#include "printer/machine/vectors.h"

namespace {

using namespace qduino;
using namespace qduino::printer;

double cpu_s() {
    timespec now{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

double peak_megabytes() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return static_cast<double>(usage.ru_maxrss) / 1024;
}

/// Plans what it is asked for. Homing is a move to where the switches are.
class Planned final : public gcode::NoActions {
  public:
    Planned(const MachineConfig& config, machine::MotionPipe& pipe) : config_(config), pipe_(pipe) {}

    Result<void> move(const gcode::Move& move) override {
        const motion::AxisVector to = machine::to_vector(move.to);
        const double filament_mm = (move.to[Axis::e] - move.from[Axis::e]).value();
        const bool fits = pipe_.planner().append(
            {{to[0], to[1], to[2]}, filament_mm, move.feedrate.value(), pipe_.accelerations().of(move.kind)});
        QDUINO_EXPECT(fits);
        ++moves;
        return {};
    }
    Result<void> dwell(Seconds duration) override {
        const bool fits = pipe_.planner().append_dwell(duration.value());
        QDUINO_EXPECT(fits);
        return {};
    }
    Result<void> home(gcode::AxisSet axes) override {
        motion::AxisVector to = pipe_.planner().position_mm();
        for (const Axis axis : gcode::kToolAxes)
            if (axes.contains(axis)) to[axis] = config_.axes[axis].home_position.value();
        const bool fits = pipe_.planner().append_to(to, 40, 1000);
        QDUINO_EXPECT(fits);
        return {};
    }
    Result<void> set_limits(const gcode::LimitChange& change) override {
        pipe_.change_limits(change);
        return {};
    }
    Result<void> set_compensation(const gcode::CompensationChange& change) override {
        pipe_.change_compensation(change);
        return {};
    }

    std::uint64_t moves = 0;

  private:
    const MachineConfig& config_;
    machine::MotionPipe& pipe_;
};

/// Takes every event off the ring, and tells loop 1 so.
class Loop2 {
  public:
    explicit Loop2(machine::MotionPipe& pipe) : pipe_(pipe) {}
    void take_all() {
        while (const step::StepEvent* event = pipe_.ring().front()) {
            steps += event->kind == step::EventKind::step;
            counts_.timeline_ns = event->time_ns;
            pipe_.ring().pop();
        }
        counts_.events_taken = pipe_.ring().popped();
        pipe_.readers().write(counts_);
        pipe_.observe();
    }
    [[nodiscard]] double timeline_s() const { return static_cast<double>(counts_.timeline_ns) * 1e-9; }

    std::uint64_t steps = 0;

  private:
    machine::MotionPipe& pipe_;
    link::MotionCounts counts_;
};

Result<bench::Json> plan(const std::string& name, const MachineConfig& config, const std::string& bytes) {
    std::atomic<std::uint32_t> emergency{0};
    const auto pipe = std::make_unique<machine::MotionPipe>(config, emergency);
    Planned planned(config, *pipe);
    Loop2 loop2(*pipe);
    gcode::Interpreter interpreter(config, planned);
    gcode::Parser parser;
    std::uint64_t lines = 0;
    const double begin_s = cpu_s();
    const auto make_room = [&](bool more) {
        do {
            pipe->pump(more);
            loop2.take_all();
        } while (!pipe->has_room());
    };
    std::span<const char> rest{bytes};
    for (bool ended = false; !ended;) {
        const gcode::Line* line = parser.next(rest);
        if (line == nullptr && (ended = rest.empty())) line = parser.finish();
        if (line == nullptr) continue;
        ++lines;
        if (line->error) return *line->error;
        if (line->command != nullptr)
            QDUINO_TRY(interpreter.execute(*line->command, machine::kArcPiecesAtOnce));
        while (interpreter.pending()) {
            make_room(true);
            QDUINO_TRY(interpreter.proceed(machine::kArcPiecesAtOnce));
        }
        if (!pipe->has_room()) make_room(true);
    }
    while (!pipe->drained()) make_room(false);
    const double took_s = cpu_s() - begin_s;
    const auto rate = [&](std::uint64_t count) {
        return static_cast<std::int64_t>(static_cast<double>(count) / took_s);
    };
    return bench::Json{{"motion", name},
                       {"lines", lines},
                       {"moves", planned.moves},
                       {"steps", loop2.steps},
                       {"print_s", static_cast<std::int64_t>(loop2.timeline_s())},
                       {"cpu_s", std::round(took_s * 1000) / 1000},
                       {"lines_per_s", rate(lines)},
                       {"moves_per_s", rate(planned.moves)},
                       {"steps_per_s", rate(loop2.steps)},
                       {"peak_mb", std::round(peak_megabytes() * 10) / 10}};
}

/// The reference machine, and what is added to it.
std::vector<std::pair<std::string, MachineConfig>> kinds_of_motion() {
    const auto with = [](bool shapers, bool advance, bool jerk) {
        MachineConfig config;
        if (shapers) config.axes[Axis::x].shaper = {ShaperType::mzv, 40, 0.1};
        if (shapers) config.axes[Axis::y].shaper = {ShaperType::ei, 50, 0.1};
        if (advance) config.pressure_advance.advance = Seconds{0.05};
        if (jerk) config.jerk_mm_s3 = 100'000;
        return config;
    };
    return {{"plain", with(false, false, false)},
            {"shapers", with(true, false, false)},
            {"advance", with(false, true, false)},
            {"jerk", with(false, false, true)},
            {"all", with(true, true, true)}};
}

int fail(std::string_view why) {
    std::fprintf(stderr, "bench-plan: %.*s\n", static_cast<int>(why.size()), why.data());
    return 2;
}

}  // namespace

int main(int argc, char** argv) {
    std::string file;
    std::string machine_file;
    bool json = false;
    for (int i = 1; i < argc; ++i) {
        const std::string_view word = argv[i];
        if (word == "--json") {
            json = true;
        } else if (word == "--machine" && i + 1 < argc) {
            machine_file = argv[++i];
        } else {
            file = word;
        }
    }
    if (file.empty()) return fail("which file? usage: bench-plan FILE [--machine M.toml] [--json]");
    const Result<std::string> bytes = posix::read_small_file(file);
    if (!bytes) return fail(bytes.error().message);
    auto kinds = kinds_of_motion();
    if (!machine_file.empty()) {
        const Result<MachineConfig> config = apps::read_machine_file(machine_file);
        if (!config) return fail(config.error().message);
        kinds = {{machine_file, *config}};
    }
    bench::Report report;
    for (const auto& [name, config] : kinds) {
        const Result<bench::Json> result = plan(name, config, *bytes);
        if (!result) return fail(result.error().message);
        report.results.push_back(*result);
    }
    const double plain = report.results.front()["steps_per_s"].get<double>();
    report.remarks.push_back(
        bench::verdict(plain >= 20e6, "20 million steps a second: %.1f in the first row", plain / 1e6));
    bench::print(report, json);
    return 0;
}
