// The whole printer in one process and in virtual time: twin, simulated board, runtime, the
// unchanged printer sketch.
//
//   LinkLayout ◄─► printer.ino ◄─► Runtime ◄─► SimBoard ◄─► [step log] ◄─► twin::Printer
//
// One per process: the sketch's own objects are static, as a sketch's are.
#pragma once

#include <memory>

#include "base/result.h"
#include "board/sim/sim_board.h"
#include "printer/link/layout.h"
#include "printer/machine_config.h"
#include "runtime/runtime.h"
#include "twin/printer.h"

namespace qduino::apps {

class SimPrinter {
  public:
    /// `metal`: the machine that stands there in truth. `link` is zeroed or a fresh object.
    SimPrinter(const printer::MachineConfig& config, const twin::Machine& metal,
               printer::link::LinkLayout& link);
    ~SimPrinter();
    SimPrinter(const SimPrinter&) = delete;
    SimPrinter& operator=(const SimPrinter&) = delete;

    /// Admits and starts the sketch. `front`: what the board sees as its peripherals; null for the
    /// twin itself. `computer`: the simulated one; its peripherals are the twin's.
    Result<void> begin(board::Peripherals* front = nullptr, const board::sim::SimConfig& computer = {});
    /// Writes the guarantee report, as of now, into the link; begin() has done so once.
    void publish_guarantee();
    /// Plays everything before `until`. Returns false when the sketch has stopped.
    bool run(Instant until);
    [[nodiscard]] Instant now() const { return now_; }

    /// After begin().
    [[nodiscard]] const board::sim::SimBoard& board() const { return *board_; }
    [[nodiscard]] const runtime::Runtime& runtime() const { return *runtime_; }
    [[nodiscard]] twin::Printer& twin() { return twin_; }
    [[nodiscard]] printer::link::LinkLayout& link() { return link_; }
    [[nodiscard]] const printer::MachineConfig& config() const { return config_; }

  private:
    printer::MachineConfig config_;
    printer::link::LinkLayout& link_;
    twin::Printer twin_;
    std::unique_ptr<board::sim::SimBoard> board_;
    std::unique_ptr<runtime::Runtime> runtime_;
    Instant now_{};
};

/// printer-sim as a live machine: linked to a running print service, paced at K times wall time.
struct LiveOptions {
    printer::MachineConfig machine;
    twin::Machine metal;       ///< what the twin is
    std::string link_path;     ///< made anew; the service opens it
    std::string inspect_path;  ///< unix socket of the twin's inspector; empty: none
    double speed = 1;          ///< virtual seconds per second of wall time; > 0
};

/// Runs until SIGTERM or SIGINT. When the host cannot keep up, virtual time falls behind: nothing
/// is skipped.
Result<void> run_live(const LiveOptions& options);

}  // namespace qduino::apps
