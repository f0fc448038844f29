// Bytes as a job, through the whole machine: what loop 1 reads, plans and solves, what loop 2
// counts as steps; and the twin's own reader of the same bytes beside it.
//
//   bytes ─► link ─► Machine ─► step ring ─► loop 2's counts ──┐
//     └────► twin::AskedPath ──────────────────────────────────┴─ the same place, the same filament
//
// Whatever the bytes say: no contract breaks; no slide leaves its bounds; no target is above what
// its heater may have; and a job that is completed ends where the twin's reader says, to the step.
// So no part is called complete that is another than the one that was asked for.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "apps/machine_file/twin_machine.h"
#include "printer/gcode/content.h"
#include "tests/fuzz/gcode/fuzz_check.h"
#include "tests/unit/machine/fake_loops.h"
#include "tests/unit/twin/text_source.h"
#include "twin/asked_path.h"

namespace {

using namespace qduino;
using namespace qduino::printer;
using machine::MachineBench;
using machine::State;

/// 100 ms each; the fake loop 2 plays 2 s of the print in one. A job that takes longer is given up.
constexpr int kReleasesMax = 400;
/// Steps: half a one by rounding, and what the bounds take off a place (kBoundsTolerance).
constexpr double kSamePlace = 0.6;
constexpr double kSameFilament = 1.01;

const MachineConfig& config() {
    static const MachineConfig made = [] {
        MachineConfig machine;
        machine.macros.push_back({"START", "G28\nG1 X{X=5} Y9\nG3 X{X=5} I4\nM116"});
        return machine;
    }();
    return made;
}

void check_bounds(MachineBench& bench) {
    const link::JobStatus status = bench.status();
    const link::HeatStatus heat = bench.heat();
    FUZZ_EXPECT(heat.hot_end.target_celsius <= highest_target(config().hot_end).value());
    FUZZ_EXPECT(heat.bed.target_celsius <= highest_target(config().bed).value());
    for (std::size_t i = 0; i < 3; ++i) {
        if (!status.homed[i]) continue;
        const AxisConfig& axis = config().axes[i];
        const double at_mm =
            static_cast<double>(bench.loop2->steps()[i] - status.origin_steps[i]) / axis.steps_per_mm;
        // While an axis is homed anew it may go behind its home position.
        FUZZ_EXPECT(at_mm <= axis.maximum.value() + 0.1);
    }
}

void compare(MachineBench& bench, const std::string& job) {
    twin::TextSource source{job};
    const twin::Machine metal = apps::twin_machine(config());
    twin::AskedPath asked{source, twin::Position{}, metal};
    while (asked.next().kind != twin::AskedItem::Kind::end) {
    }
    const link::JobStatus status = bench.status();
    for (std::size_t i = 0; i < 3; ++i) {
        const double steps = static_cast<double>(bench.loop2->steps()[i] - status.origin_steps[i]);
        const double asked_steps = asked.position()[i] * config().axes[i].steps_per_mm;
        FUZZ_EXPECT(std::abs(steps - asked_steps) <= kSamePlace);
    }
    if (status.excursions > 0) return;  // filament is pushed beside the part, too
    const double pushed = asked.filament_net_mm() * config().axes[3].steps_per_mm;
    FUZZ_EXPECT(std::abs(static_cast<double>(bench.loop2->steps()[3]) - pushed) <= kSameFilament);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0 || size > 4000) return 0;
    const std::string job{reinterpret_cast<const char*>(data), size};
    // What the print service refuses before anything is read of it.
    if (gcode::look_at_content(job, config()) != gcode::Content::gcode) return 0;
    const auto bench = std::make_unique<MachineBench>(config());
    bench->run();
    bench->job(job);
    bench->run(2);
    int releases = 0;
    for (; releases < kReleasesMax && bench->status().outcome == link::JobOutcome::running; ++releases) {
        if (bench->status().state == State::paused) bench->command(link::Command::resume);
        bench->run();
        check_bounds(*bench);
    }
    if (bench->status().outcome == link::JobOutcome::completed) compare(*bench, job);
    return 0;
}
