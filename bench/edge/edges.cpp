#include "bench/edge/edges.h"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <random>

#include "bench/rig/child.h"
#include "bench/rig/guarantee_file.h"
#include "bench/rig/samples.h"
#include "board/linux/kernel/real_time_thread.h"
#include "board/linux/linux_board.h"
#include "board/linux/pin/pins_server.h"
#include "runtime/runtime.h"

namespace qduino::bench {
namespace {

using namespace board::linux;
using board::InputPin;
using board::PinId;

constexpr PinId kButton{11};
/// The board gives this priority to the I/O VCPU of a sketch with one loop, which comes first.
constexpr int kPriority = 79;
/// Edges at the start that are left out: caches, and the way out of the start gate.
constexpr std::size_t kWarmUp = 100;
/// For making a board and giving its memory back, beside the length of the run itself.
constexpr Nanoseconds kOverhead = 8s;

/// One line that goes up and down.
class Button final : public board::NoPeripherals {
  public:
    void press() { level_ = level_ == board::Level::low ? board::Level::high : board::Level::low; }
    board::Level pin_level(Instant, PinId pin) override {
        return pin == kButton ? level_ : board::Level::low;
    }

  private:
    board::Level level_ = board::Level::low;
};

[[noreturn]] void be_machine(PinsServer& server) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    static_cast<void>(pin_to_core(0));
    std::minstd_rand random;
    std::uniform_int_distribution<int> pause_us{700, 1300};
    Button button;
    for (Instant next = monotonic_now();; next += std::chrono::microseconds{pause_us(random)}) {
        block_until(next);
        button.press();
        server.poll(monotonic_now(), button);
    }
}

/// Where a contender writes down what it measures, and what it measures by.
class Meter {
  public:
    Meter(const PinsServer& server, SharedSamples& latencies)
        : button_(server.layout().inputs[kButton.number]), latencies_(latencies) {}
    /// Counts from the next edge on.
    void begin() { seen_ = button_.rising.load(std::memory_order_acquire); }
    [[nodiscard]] bool edge_came() const { return button_.rising.load(std::memory_order_acquire) != seen_; }
    void note(Instant now) {
        const Instant came = button_.rising_times.at(++seen_, button_.rising.load(std::memory_order_acquire));
        if (came != kForever) latencies_.push((now - came).count());
    }

  private:
    const InputPin& button_;
    SharedSamples& latencies_;
    std::uint32_t seen_ = 0;
};

runtime::Runtime* measured = nullptr;
Meter* meter = nullptr;
Nanoseconds handler_budget{};

int play_handler(const std::string& path, Nanoseconds length, const GuaranteeFile& guarantee) {
    LinuxConfig config;
    config.pins_path = path;
    auto opened = LinuxBoard::open(config);
    if (!opened) return cannot(opened.error());
    LinuxBoard& board = **opened;
    runtime::Runtime runtime{board};
    measured = &runtime;
    runtime::SketchTable table;
    table.setup = [] {
        const auto on_edge = [] { meter->note(measured->board().now()); };
        static_cast<void>(measured->board().pin_mode(kButton, board::PinMode::input));
        static_cast<void>(measured->attach_interrupt(kButton, board::Edge::rising, on_edge, handler_budget,
                                                     10ms, measured->board().core_count() - 1));
        meter->begin();
    };
    table.loops.push_back({{1, 1ms, 100ms, board.core_count() - 1},
                           [] { measured->wait_for_next_period(); },
                           __FILE__,
                           __LINE__});
    if (const auto begun = runtime.begin(table); !begun) return cannot(begun.error());
    runtime.run(board.now() + length);
    board.request_stop();
    runtime.run(board.now() + 1s);
    guarantee.write(board.guarantee());
    return 0;
}

int play_thread(const std::string& path, Nanoseconds length) {
    VirtualPins pins;
    if (!pins.attach(path) || !pins.watch_edges(kButton, board::Edge::rising)) return 1;
    touch_stack();
    if (!lock_memory() || !pin_to_core(cpu_count() - 1) || !become_real_time(kPriority)) return 1;
    meter->begin();
    for (const Instant end = monotonic_now() + length; monotonic_now() < end;) {
        const std::uint32_t seen = pins.input_changes();
        while (meter->edge_came()) meter->note(monotonic_now());
        pins.wait_input_change(seen, end);
    }
    return 0;
}

/// Runs `contender` in a child, beside a machine of its own.
EdgeLatencies run(Nanoseconds length, const std::function<int(const std::string& path)>& contender) {
    EdgeLatencies result;
    const std::string path = "/dev/shm/qduino-bench-" + std::to_string(::getpid()) + ".pins";
    auto server = PinsServer::create(path);
    if (!server) return result.failure = "no virtual pins", result;
    SharedSamples latencies{static_cast<std::size_t>(length / 1ms)};
    Meter mine{*server, latencies};
    meter = &mine;
    const auto play = [&] {
        const pid_t machine = ::fork();
        if (machine == 0) be_machine(*server);
        const int status = contender(path);
        ::kill(machine, SIGKILL);
        ::waitpid(machine, nullptr, 0);
        return status;
    };
    result.failure = run_child(play, length + kOverhead);
    std::filesystem::remove(path);
    result.ns = latencies.taken();
    result.ns.erase(result.ns.begin(),
                    result.ns.begin() + static_cast<std::ptrdiff_t>(std::min(kWarmUp, result.ns.size())));
    if (result.ns.empty() && result.failure.empty()) result.failure = "no edges were seen";
    return result;
}

}  // namespace

EdgeLatencies run_handler(Nanoseconds length, Nanoseconds budget) {
    handler_budget = budget;
    const GuaranteeFile guarantee;
    EdgeLatencies result =
        run(length, [&](const std::string& path) { return play_handler(path, length, guarantee); });
    result.guarantee = guarantee.read();
    return result;
}

EdgeLatencies run_plain_thread(Nanoseconds length) {
    return run(length, [&](const std::string& path) { return play_thread(path, length); });
}

}  // namespace qduino::bench
