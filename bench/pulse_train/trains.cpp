#include "bench/pulse_train/trains.h"

#include <sys/mman.h>
#include <sys/prctl.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "bench/rig/child.h"
#include "bench/rig/guarantee_file.h"
#include "bench/rig/pins.h"
#include "bench/rig/samples.h"
#include "board/linux/kernel/real_time_thread.h"
#include "board/linux/linux_board.h"

namespace qduino::bench {
namespace {

using namespace board::linux;

/// The time until a train runs evenly: pages touched, caches warm.
constexpr Nanoseconds kStart = 300ms;
/// For making and giving back a core, beside the length of the train itself.
constexpr Nanoseconds kOverhead = 8s;

/// Notes when pin 6 rises.
class EdgeRecorder final : public board::NoPeripherals {
  public:
    void pin_written(Instant now, board::PinId pin, board::Level level) override {
        if (pin.number == kTrainPin && level == board::Level::high) rising_ns.push_back(to_ns(now));
    }
    std::vector<std::int64_t> rising_ns;
};

/// The pins of one train, and its edges.
struct TrainPins {
    EdgeRecorder recorder;
    Pins pins{recorder};
};

void drop_start(std::vector<std::int64_t>& instants) {
    if (instants.empty()) return;
    const std::int64_t from = instants.front() + to_ns(kStart);
    instants.erase(instants.begin(), std::lower_bound(instants.begin(), instants.end(), from));
}

Train seen_on(TrainPins& train_pins, std::string failure) {
    ::usleep(20'000);  // what a dead writer held back is let go
    Pins& pins = train_pins.pins;
    pins.poll();
    Train train;
    train.failure = std::move(failure);
    train.rising_ns = std::move(train_pins.recorder.rising_ns);
    train.lost_edges = pins.lost();
    drop_start(train.rising_ns);
    if (train.rising_ns.size() < 2 && train.failure.empty()) train.failure = "made no pulses";
    return train;
}

/// What Linux has for a process that wants to be on time: no page fault, no slack of its timers,
/// first among the threads of its core.
bool become_punctual() {
    constexpr int kPriority = 50;
    return ::mlockall(MCL_CURRENT | MCL_FUTURE) == 0 && ::prctl(PR_SET_TIMERSLACK, 1UL) == 0 &&
           become_real_time(kPriority).ok();
}

/// The paper's Listing 1, with virtual pins in place of its GPIO calls.
int play_listing1(const std::string& pins_path, Nanoseconds length, bool real_time) {
    if (real_time && ::geteuid() == 0 && !become_punctual()) return 1;
    VirtualPins pins;
    constexpr board::VcpuId kWriter = 1;
    const board::PinId pin{kTrainPin};
    if (!pins.attach(pins_path) || !pins.open_writer(kWriter, true) ||
        !pins.set_mode(kWriter, pin, board::PinMode::output))
        return 1;
    const Instant end = monotonic_now() + length;
    const timespec wait{.tv_sec = 0, .tv_nsec = static_cast<long>(kTrainPeriod.count())};
    while (monotonic_now() < end) {
        ::nanosleep(&wait, nullptr);
        pins.write(kWriter, pin, board::Level::high);
        pins.write(kWriter, pin, board::Level::low);
    }
    return 0;
}

struct Floor {
    LinuxBoard* board;
    SharedSamples* samples;
    std::optional<Nanoseconds> phase;  ///< of its grid; none: relative
};

/// Waits for each instant of the grid, or for 100 µs after the one before was seen; goes on as soon
/// as the clock shows it.
void spin_floor(void* context) {
    const Floor& floor = *static_cast<const Floor*>(context);
    Instant due = monotonic_now() + kTrainPeriod;
    if (floor.phase) due += *floor.phase - due.time_since_epoch() % kTrainPeriod;
    while (!floor.board->stop_requested() && !floor.samples->full()) {
        Instant now = monotonic_now();
        while (now < due) now = monotonic_now();
        floor.samples->push(to_ns(now));
        due = (floor.phase ? due : now) + kTrainPeriod;
    }
}

int play_floor(SharedSamples& samples, std::optional<Nanoseconds> phase, Nanoseconds length,
               const GuaranteeFile& guarantee) {
    LinuxConfig config;
    config.isolate = true;
    auto opened = LinuxBoard::open(std::move(config));
    if (!opened) return cannot(opened.error());
    LinuxBoard& board = *opened.value();
    Floor floor{.board = &board, .samples = &samples, .phase = phase};
    board::VcpuSpec spec{{1, kTrainPeriod, kTrainPeriod, board.core_count() - 1}};
    spec.owns_core = true;
    spec.entry = &spin_floor;
    spec.context = &floor;
    if (const auto started = board.start(std::span{&spec, 1}); !started) return cannot(started.error());
    guarantee.write(board.guarantee());
    board.run(board.now() + length);
    board.request_stop();
    board.run(board.now() + 2s);
    return 0;
}

Train run_bare_spin(Nanoseconds length, std::optional<Nanoseconds> phase) {
    SharedSamples samples{static_cast<std::size_t>((length + kStart) / kTrainPeriod) + 1000};
    const GuaranteeFile guarantee;
    std::string failure =
        run_child([&] { return play_floor(samples, phase, length + kStart, guarantee); }, length + kOverhead);
    Train train;
    train.failure = std::move(failure);
    train.rising_ns = samples.taken();
    train.guarantee = guarantee.read();
    drop_start(train.rising_ns);
    if (train.rising_ns.size() < 2 && train.failure.empty()) train.failure = "took no samples";
    return train;
}

}  // namespace

Train run_listing1(Nanoseconds length, bool real_time) {
    TrainPins on;
    Pins& pins = on.pins;
    if (!pins.ready()) return failed_train("no virtual pins to be had in /dev/shm");
    std::string failure = run_child([&] { return play_listing1(pins.path(), length + kStart, real_time); },
                                    length + kOverhead, [&] { pins.poll(); });
    Train train = seen_on(on, std::move(failure));
    if (real_time && ::geteuid() != 0)
        train.guarantee = {
            {"loops", {{{"shortfall", "no real-time priority, no locked memory: run as root"}}}}};
    return train;
}

Train run_sketch(const std::string& program, Nanoseconds length) {
    TrainPins on;
    Pins& pins = on.pins;
    if (!pins.ready()) return failed_train("no virtual pins to be had in /dev/shm");
    const GuaranteeFile guarantee;
    const std::string log = pins.path() + ".log";
    const std::string seconds = std::to_string(to_seconds(length + kStart));
    std::string failure = run_program(
        {program, "--pins", pins.path(), "--isolate", "--for", seconds, "--report", guarantee.path()},
        length + kOverhead, log, [&] { pins.poll(); });
    const bool good = failure.empty();
    Train train = seen_on(on, std::move(failure));
    train.guarantee = guarantee.read();
    if (good) std::filesystem::remove(log);
    return train;
}

Train run_floor(Nanoseconds length, Nanoseconds phase) { return run_bare_spin(length, phase); }
Train run_floor_relative(Nanoseconds length) { return run_bare_spin(length, std::nullopt); }

Nanoseconds phase_of(const Train& train) {
    if (train.rising_ns.empty()) return Nanoseconds{0};
    // A pulse may be late. The median is the grid's phase, plus 0.1 us of writing.
    std::vector<std::int64_t> phases;
    for (const std::int64_t instant : train.rising_ns) phases.push_back(instant % kTrainPeriod.count());
    const auto median = phases.begin() + static_cast<std::ptrdiff_t>(phases.size() / 2);
    std::nth_element(phases.begin(), median, phases.end());
    return Nanoseconds{*median};
}

}  // namespace qduino::bench
