#include "bench/steps/step_trials.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "base/fixed_vector.h"
#include "bench/rig/child.h"
#include "bench/rig/guarantee_file.h"
#include "bench/rig/pins.h"
#include "bench/rig/samples.h"
#include "board/linux/linux_board.h"
#include "channel/ring_buffer.h"
#include "printer/step/stepper_loop.h"

namespace qduino::bench {
namespace {

using board::Level;
using board::PinId;
using board::linux::LinuxBoard;
using board::linux::LinuxConfig;
using printer::link::MotionCounts;
using printer::link::MotionStatus;
using printer::step::EventKind;
using printer::step::StepEvent;

/// The most steps of one trial.
constexpr std::size_t kMostSteps = std::size_t{1} << 21;
using StepRing = channel::RingBuffer<StepEvent, kMostSteps>;

constexpr board::VcpuId kLoop = 2;
constexpr Nanoseconds kPeriod = 100us;
/// For making a board and giving its memory back, and between two trials.
constexpr Nanoseconds kOverhead = 8s, kPause = 30ms;
constexpr int kNumbers = 7;  // that a trial reports

PinId step_pin(int axis) { return PinId{static_cast<std::uint16_t>(2 + 4 * axis)}; }
PinId direction_pin(int axis) { return PinId{static_cast<std::uint16_t>(3 + 4 * axis)}; }

/// Goes through the board's seam, as the sketch's does.
class StepperPins {
  public:
    explicit StepperPins(board::Board& board) : board_(board) {}
    [[nodiscard]] Instant now() { return board_.now(); }
    void busy_until(Instant t) { board_.busy_until(t); }
    void sleep_until(Instant t) { board_.sleep_until(t); }
    void set_steps(const printer::step::MotorList& motors, bool high) {
        FixedVector<PinId, printer::kAxisCount> pins;
        for (const int motor : motors) pins.push_back(step_pin(motor));
        board_.pins_write(pins, high ? Level::high : Level::low);
    }
    void set_direction(int axis, bool positive) {
        board_.pin_write(direction_pin(axis), positive ? Level::high : Level::low);
    }
    [[nodiscard]] bool endstop_pressed(int) { return false; }
    void watch_switches(int, bool) {}
    void cut_heat() {}

  private:
    board::Board& board_;
};

struct NoStops {
    [[nodiscard]] std::uint32_t stop_asked() const { return 0; }
    [[nodiscard]] bool emergency_pending() const { return false; }
};

/// What the loop needs, made before it starts.
struct Stage {
    LinuxBoard* board;
    SharedSamples* results;
    int axes;
    const std::vector<double>* rates_hz;
    Nanoseconds length;
    std::unique_ptr<StepRing> ring = std::make_unique<StepRing>();
    std::array<channel::FourSlot<MotionCounts>, 2> loops{};
    std::unique_ptr<channel::FourSlot<MotionStatus>> service =
        std::make_unique<channel::FourSlot<MotionStatus>>();
};

std::int64_t fill(StepRing& ring, int axes, double rate_hz, Nanoseconds length) {
    const auto count = std::min(static_cast<std::size_t>(rate_hz * to_seconds(length)), kMostSteps);
    for (std::size_t i = 0; i < count; ++i) {
        const StepEvent event{.time_ns = std::llround(static_cast<double>(i) * 1e9 / rate_hz),
                              .kind = EventKind::step,
                              .axis = static_cast<std::uint8_t>(i % static_cast<std::size_t>(axes))};
        static_cast<void>(ring.try_push(event));
    }
    return static_cast<std::int64_t>(count);
}

/// Plays one rate, and reports its numbers.
void play(Stage& stage, double rate_hz) {
    StepperPins pins{*stage.board};
    const printer::step::PlayerSettings quick{.pulse = 100ns, .low = 100ns, .direction = 20ns};
    const NoStops stops;
    printer::step::StepperLoop loop{
        pins,           *stage.ring,
        stops,          channel::Broadcast<MotionCounts, 2>{{&stage.loops[0], &stage.loops[1]}},
        *stage.service, quick};
    const std::int64_t count = fill(*stage.ring, stage.axes, rate_hz, stage.length);
    while (!stage.ring->empty() && !stage.board->stop_requested()) loop.step();
    const Instant told = stage.board->now() + 120ms;  // the service is told every 100 ms
    while (stage.board->now() < told) loop.step();
    const MotionStatus& status = stage.service->read();
    const auto at = [&](double share) {
        return static_cast<std::int64_t>(status.lateness_ns.quantile(share));
    };
    const double nominal_s = static_cast<double>(count) / rate_hz;
    const double played_hz =
        static_cast<double>(count) / (nominal_s + static_cast<double>(status.shift_ns) * 1e-9);
    for (const std::int64_t number :
         {count, static_cast<std::int64_t>(played_hz), at(0.5), at(0.99), at(0.9999),
          static_cast<std::int64_t>(status.lateness_ns.max()), static_cast<std::int64_t>(status.late_steps)})
        stage.results->push(number);
}

void play_all(void* context) {
    Stage& stage = *static_cast<Stage*>(context);
    for (const double rate_hz : *stage.rates_hz) {
        play(stage, rate_hz);
        stage.board->sleep_until(stage.board->now() + kPause);
    }
    stage.board->request_stop();
}

int play_on_board(const std::string& pins_path, Stage stage, const GuaranteeFile& guarantee) {
    LinuxConfig config;
    config.pins_path = pins_path;
    config.isolate = true;
    auto opened = LinuxBoard::open(std::move(config));
    if (!opened) return cannot(opened.error());
    LinuxBoard& board = *opened.value();
    stage.board = &board;
    for (int axis = 0; axis < stage.axes; ++axis) {
        for (const PinId pin : {step_pin(axis), direction_pin(axis)})
            if (!board.pin_mode(pin, board::PinMode::output)) return 1;
    }
    board::VcpuSpec spec{{kLoop, kPeriod, kPeriod, board.core_count() - 1}};
    spec.owns_core = true;
    spec.entry = &play_all;
    spec.context = &stage;
    if (const auto started = board.start(std::span{&spec, 1}); !started) return cannot(started.error());
    guarantee.write(board.guarantee());
    board.run(kForever);
    return 0;
}

/// Counts the steps that it sees.
class StepCounter final : public board::NoPeripherals {
  public:
    void pin_written(Instant, PinId, Level level) override { rising += level == Level::high ? 1 : 0; }
    std::int64_t rising = 0;
};

}  // namespace

StepTrials run_step_trials(int axes, const std::vector<double>& rates_hz, Nanoseconds length) {
    StepCounter counter;
    Pins pins{counter};
    StepTrials all;
    if (!pins.ready()) {
        all.failure = "no virtual pins to be had in /dev/shm";
        return all;
    }
    const GuaranteeFile guarantee;
    SharedSamples results{kNumbers * rates_hz.size() + 1};
    const Nanoseconds limit =
        (length + kPause + 200ms) * static_cast<std::int64_t>(rates_hz.size()) + kOverhead;
    all.failure = run_child(
        [&] {
            return play_on_board(pins.path(),
                                 {.board = nullptr,
                                  .results = &results,
                                  .axes = axes,
                                  .rates_hz = &rates_hz,
                                  .length = length},
                                 guarantee);
        },
        limit, [&] { pins.poll(); });
    ::usleep(20'000);  // what a dead writer held back is let go
    pins.poll();
    all.guarantee = guarantee.read();
    const std::vector<std::int64_t> numbers = results.taken();
    std::int64_t played = 0;
    for (std::size_t i = 0; i + kNumbers <= numbers.size(); i += kNumbers) {
        const std::int64_t* n = &numbers[i];
        all.trials.push_back(
            {rates_hz[i / kNumbers], static_cast<double>(n[1]), n[2], n[3], n[4], n[5], n[6]});
        played += n[0];
    }
    // Each axis' DIR is set high once a trial, when a player is made.
    all.missing_edges = played + static_cast<std::int64_t>(all.trials.size()) * axes - counter.rising;
    return all;
}

}  // namespace qduino::bench
