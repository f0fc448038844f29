#include "apps/printer_sim/sim_printer.h"

#include <chrono>
#include <ctime>
#include <thread>

#include "PrinterWiring.h"
#include "inspect/inspect_service.h"
#include "link/link_file.h"
#include "link/live_guarantee.h"
#include "terminal/program.h"

namespace qduino::apps {
namespace {

using WallClock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kWallSlice{5};
/// Further behind than this, the pace starts anew from now: a suspended laptop must not sprint when
/// it wakes.
constexpr std::chrono::milliseconds kBehindMax{250};

}  // namespace

SimPrinter::SimPrinter(const printer::MachineConfig& config, const twin::Machine& metal,
                       printer::link::LinkLayout& link)
    : config_(config), link_(link), twin_(metal) {}

SimPrinter::~SimPrinter() {
    if (board_) {
        board_->request_stop();
        board_->run(now_ + 1s);
    }
}

Result<void> SimPrinter::begin(board::Peripherals* front, const board::sim::SimConfig& computer) {
    sketches::printer_wiring() = {config_, &link_};
    board_ = std::make_unique<board::sim::SimBoard>(computer,
                                                    front ? *front : static_cast<board::Peripherals&>(twin_));
    runtime_ = std::make_unique<runtime::Runtime>(*board_);
    QDUINO_TRY(runtime_->begin(runtime::sketch_table()));
    publish_guarantee();
    return {};
}

void SimPrinter::publish_guarantee() { apps::publish_guarantee(link_, *runtime_); }

bool SimPrinter::run(Instant until) {
    board_->run(until);
    now_ = until;
    return !board_->stop_requested();
}

Result<void> run_live(const LiveOptions& options) {
    QDUINO_TRY_ASSIGN(const LinkFile link,
                      create_link(options.link_path, static_cast<std::uint64_t>(std::time(nullptr))));
    link.get()->time_factor.store(options.speed, std::memory_order_relaxed);
    SimPrinter printer(options.machine, options.metal, *link.get());
    InspectService inspector(printer.twin(), [&printer] { return printer.now(); });
    QDUINO_TRY_ASSIGN(const auto socket, serve_inspector(options.inspect_path, inspector));
    QDUINO_TRY(printer.begin());
    stop_on_signals();

    WallClock::time_point wall_start = WallClock::now();
    Instant virtual_start = printer.now();
    WallClock::time_point published = wall_start;
    while (!stop_asked()) {
        std::this_thread::sleep_for(kWallSlice);
        const double wall_s = std::chrono::duration<double>(WallClock::now() - wall_start).count();
        const Instant due = virtual_start + from_seconds(wall_s * options.speed);
        // In slices of virtual time, so that the inspector and a signal are served while a fast
        // print runs.
        const Instant end = std::min(due, printer.now() + 500ms);
        if (!printer.run(end)) return {};
        if (socket) socket->poll();
        if (WallClock::now() - published >= kGuaranteeEvery) {
            printer.publish_guarantee();
            published = WallClock::now();
        }
        if (due - end > from_seconds(std::chrono::duration<double>(kBehindMax).count() * options.speed)) {
            wall_start = WallClock::now();
            virtual_start = printer.now();
        }
    }
    link.get()->sketch_dead.store(1);
    return {};
}

}  // namespace qduino::apps
