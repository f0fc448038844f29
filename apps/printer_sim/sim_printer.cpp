#include "apps/printer_sim/sim_printer.h"

#include "PrinterWiring.h"
#include "apps/guarantee/guarantee_report.h"
#include "apps/machine_file/twin_machine.h"

namespace qduino::apps {

SimPrinter::SimPrinter(const printer::MachineConfig& config, printer::link::LinkLayout& link)
    : config_(config), link_(link), twin_(twin_machine(config)) {}

SimPrinter::~SimPrinter() {
    if (board_) {
        board_->request_stop();
        board_->run(now_ + 1s);
    }
}

Result<void> SimPrinter::begin(board::Peripherals* front) {
    sketches::printer_wiring() = {config_, &link_};
    board_ = std::make_unique<board::sim::SimBoard>(board::sim::SimConfig{},
                                                    front ? *front : static_cast<board::Peripherals&>(twin_));
    runtime_ = std::make_unique<runtime::Runtime>(*board_);
    QDUINO_TRY(runtime_->begin(runtime::sketch_table()));
    link_.guarantee.write({std::string_view{guarantee_json(board_->guarantee())}});
    return {};
}

bool SimPrinter::run(Instant until) {
    board_->run(until);
    now_ = until;
    return !board_->stop_requested();
}

}  // namespace qduino::apps
