// The app's input to the printer sketch before it starts: the machine's numbers and the link to the
// print service.
#pragma once

#include "printer/link/layout.h"
#include "printer/machine_config.h"

namespace qduino::sketches {

struct PrinterWiring {
    printer::MachineConfig config;
    printer::link::LinkLayout* link = nullptr;
    /// Measure what a step costs before anything moves. In the simulator a step costs nothing.
    bool measure_steps = false;
};

/// Set by the app before setup() runs; read by Printer::begin().
inline PrinterWiring& printer_wiring() {
    static PrinterWiring wiring;
    return wiring;
}

}  // namespace qduino::sketches
