// Bytes as a job, through the whole machine: what loop 1 reads, plans and solves, what loop 2
// plays; and the twin beside it, which reads the same bytes and sees the steps.
//
//   bytes ─► link ─► Machine ─► step ring ─► loop 2 ─ steps, switches ─┬──────────► twin::Inspector
//     ├────► twin::AskedPath ── the same place, the same filament ─────┤                   │
//     └────────────────────────────────────────────────────────────────┼─ one step lost ─► another
//
// Whatever the bytes say: no contract breaks; no slide leaves its bounds; no target is above what
// its heater may have; a job that is completed ends where the twin's reader says, to the step; and
// the same steps without one of them are no match. So no part is called complete, and none the
// right one, that is another than the one that was asked for.
//
// A small machine: its motors have coarse steps, so that a run costs milliseconds.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include "config/twin_machine.h"
#include "printer/gcode/content.h"
#include "tests/fuzz/gcode/fuzz_check.h"
#include "tests/unit/machine/fake_loops.h"
#include "tests/unit/twin/text_source.h"
#include "twin/asked_path.h"
#include "twin/inspector.h"
#include "twin/report.h"

namespace {

using namespace qduino;
using namespace qduino::printer;
using machine::MachineBench;
using machine::State;

/// 100 ms each; the fake loop 2 plays 2 s of the print in one. A job that takes longer is given up,
/// and so is one of more steps.
constexpr int kReleasesMax = 400;
constexpr std::size_t kSeenMax = 60'000;
/// Steps: half a one by rounding, and what the bounds take off a place (kBoundsTolerance).
constexpr double kSamePlace = 0.6;
constexpr double kSameFilament = 1.01;
/// So near to the half between two steps the twin takes both for right.
constexpr double kEitherWay = 0.51;

// ---- memory -------------------------------------------------------------------------------------

/// A machine and its link are 9 MB, and the sanitizer's allocator asks the system for such blocks
/// each time: a quarter of a run. So they are kept for the next input. (Both are aligned to cache
/// lines, so no other operator new makes them.)
struct KeptBlock {
    void* memory = nullptr;
    std::size_t size = 0;
    bool free = false;
};
constexpr std::size_t kLarge = std::size_t{1} << 20;
std::array<KeptBlock, 4> kept_blocks{};

}  // namespace

void* operator new(std::size_t size, std::align_val_t alignment) {
    KeptBlock* unused = nullptr;
    for (KeptBlock& block : kept_blocks) {
        if (block.memory == nullptr) unused = &block;
        if (!block.free || block.size != size) continue;
        block.free = false;
        return block.memory;
    }
    void* const memory = std::aligned_alloc(static_cast<std::size_t>(alignment), size);
    if (memory == nullptr) std::abort();
    if (size >= kLarge && unused != nullptr) *unused = {memory, size, false};
    return memory;
}
void operator delete(void* memory, std::align_val_t) noexcept {
    for (KeptBlock& block : kept_blocks) {
        if (memory == nullptr || block.memory != memory) continue;
        block.free = true;
        return;
    }
    std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t alignment) noexcept {
    operator delete(memory, alignment);
}

namespace {

// ---- the machine, and what is seen of it --------------------------------------------------------

const MachineConfig& config() {
    static const MachineConfig made = [] {
        MachineConfig machine;
        constexpr std::array<double, kAxisCount> kCoarse{20, 20, 100, 24};
        for (std::size_t i = 0; i < kAxisCount; ++i) machine.axes[i].steps_per_mm = kCoarse[i];
        machine.macros.push_back({"START", "G28\nG1 X{X=5} Y9\nG3 X{X=5} I4\nM116"});
        return machine;
    }();
    return made;
}

/// Everything that moved, in order.
class Record final : public twin::MotionObserver {
  public:
    struct Seen {
        Instant at{};
        std::int64_t position = 0;
        std::uint8_t axis = 0;
        std::int8_t direction = 0;  ///< 0: no step, a switch
        bool pressed = false;
    };
    void on_step(const twin::StepSeen& step) override {
        seen.push_back({step.at, step.position, step.axis, step.direction, false});
    }
    void on_endstop(Instant at, int axis, bool pressed) override {
        seen.push_back({at, 0, static_cast<std::uint8_t>(axis), 0, pressed});
        last_switch = seen.size();
    }

    std::vector<Seen> seen;
    std::size_t last_switch = 0;
};

/// Is that the part of `job`, if step `lost` is not there?
twin::Report judged(const Record& record, const std::string& job, std::uint64_t excursions,
                    std::size_t lost = SIZE_MAX) {
    const twin::Machine metal = apps::twin_machine(config());
    twin::TextSource source{job};
    twin::Inspector inspector{metal, source, twin::InspectionStart::at_power_on(metal, {}, {})};
    std::array<std::int64_t, kAxisCount> off{};
    Instant now = kEpoch;
    for (std::size_t i = 0; i < record.seen.size(); ++i) {
        const Record::Seen& each = record.seen[i];
        now = each.at;
        if (each.direction == 0) {
            inspector.on_endstop(each.at, each.axis, each.pressed);
        } else if (i == lost) {
            off[each.axis] = each.direction;
        } else {
            inspector.on_step({each.at, each.axis, each.direction, each.position - off[each.axis]});
        }
    }
    twin::Report report;
    report.findings = inspector.finish(now + 100ms);
    report.excursions_told = excursions;
    judge(report, metal);
    return report;
}

// ---- the properties -----------------------------------------------------------------------------

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
        FUZZ_EXPECT(at_mm <= axis.maximum.value() + 0.1);
        FUZZ_EXPECT(at_mm >= axis.minimum.value() - 0.1);
    }
}

using Slides = std::array<double, 3>;

/// How many steps each slide stands beside what was asked: not one. Absent: the head has been
/// beside the path, and a job that ends in the part leaves it there.
std::optional<Slides> compare_ends(MachineBench& bench, const std::string& job) {
    twin::TextSource source{job};
    const twin::Machine metal = apps::twin_machine(config());
    twin::AskedPath asked{source, twin::Position{}, metal};
    while (asked.next().kind != twin::AskedItem::Kind::end) {
    }
    const link::JobStatus status = bench.status();
    if (status.excursions > 0) return std::nullopt;
    Slides beside{};
    for (std::size_t i = 0; i < beside.size(); ++i) {
        const double steps = static_cast<double>(bench.loop2->steps()[i] - status.origin_steps[i]);
        beside[i] = steps - asked.position()[i] * config().axes[i].steps_per_mm;
        FUZZ_EXPECT(std::abs(beside[i]) <= kSamePlace);
    }
    const double pushed = asked.filament_net_mm() * config().axes[3].steps_per_mm;
    FUZZ_EXPECT(std::abs(static_cast<double>(bench.loop2->steps()[3]) - pushed) <= kSameFilament);
    return beside;
}

/// A step of a slide behind the last homing, where there is one: the middle one. Its slide then
/// ends beside what was asked. Between two steps both are right (docs/twin.md): a step that leads
/// from one of them to the other makes no other part.
std::optional<std::size_t> step_to_lose(const Record& record, const Slides& beside) {
    for (std::size_t i = (record.last_switch + record.seen.size()) / 2; i < record.seen.size(); ++i) {
        const Record::Seen& each = record.seen[i];
        if (each.direction == 0 || each.axis >= beside.size()) continue;
        if (std::abs(beside[each.axis] - each.direction) > kEitherWay) return i;
    }
    return std::nullopt;
}

/// A detour beside a G28 may be reported as a difference (twin/inspector.h): a job with one need
/// not match.
void compare_parts(const Record& record, const std::string& job, std::uint64_t excursions,
                   const std::optional<Slides>& beside) {
    const twin::Report report = judged(record, job, excursions);
    if (!report.matches) std::fprintf(stderr, "%s\n", to_json(report).c_str());
    FUZZ_EXPECT(report.matches || excursions > 0);
    if (!beside) return;
    if (const auto lost = step_to_lose(record, *beside))
        FUZZ_EXPECT(!judged(record, job, excursions, *lost).matches);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0 || size > 4000) return 0;
    const std::string job{reinterpret_cast<const char*>(data), size};
    // What the print service refuses before anything is read of it.
    if (gcode::look_at_content(job, config()) != gcode::Content::gcode) return 0;
    const auto bench = std::make_unique<MachineBench>(config());
    static Record record;
    record.seen.clear();
    record.last_switch = 0;
    bench->loop2->observe(&record);
    bench->run();
    bench->job(job);
    bench->run(2);
    for (int releases = 0; releases < kReleasesMax; ++releases) {
        if (bench->status().outcome != link::JobOutcome::running) break;
        if (record.seen.size() > kSeenMax) return 0;
        if (bench->status().state == State::paused) bench->command(link::Command::resume);
        bench->run();
        check_bounds(*bench);
    }
    if (bench->status().outcome != link::JobOutcome::completed) return 0;
    const std::optional<Slides> beside = compare_ends(*bench, job);
    compare_parts(record, job, bench->status().excursions, beside);
    return 0;
}
