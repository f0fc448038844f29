// The virtual machine: the twin behind the Linux board's shared-memory pins, for as long as its
// owner wants.
//
//   sketch ──edges, bus requests──► PinsServer ──► twin::Printer
//                                                      ▲
//   printd, tests ──► InspectServer ──► InspectService ┘
//
// As a real machine does, it outlives the sketch: a sketch that dies leaves the carriage where it
// stands and the heaters as they were, until the supervisor or the next sketch drives the pins.
//
// One thread. A pass delivers what has come over the pins, then serves the socket; between passes
// it sleeps at most kPass, or until a bus request rings.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "board/linux/pin/pins_server.h"
#include "inspect/inspect_service.h"
#include "twin/fault.h"
#include "twin/machine.h"
#include "twin/printer.h"

namespace qduino::apps {

struct VirtualMachineOptions {
    std::string pins;        ///< file of the virtual pins; on a tmpfs
    std::string inspect;     ///< socket of the inspector; empty: none
    bool own_clock = false;  ///< the sketch is in an emulated machine
    twin::Machine machine{};
    std::vector<twin::Fault> faults;  ///< their instants count from start-up
};

class VirtualMachine {
  public:
    static constexpr Nanoseconds kPass{1'000'000};

    /// Makes the pins and the socket. Errors: those of PinsServer::create and
    /// InspectServer::listen.
    static Result<std::unique_ptr<VirtualMachine>> create(const VirtualMachineOptions& options);

    /// One pass.
    void pass();
    /// The machine as it is now, after every edge written before the call.
    [[nodiscard]] twin::PrinterState state() { return printer_.state(drain()); }
    [[nodiscard]] twin::Printer& printer() { return printer_; }
    /// What went wrong between the sketch and the twin; all 0 in a healthy run.
    [[nodiscard]] board::linux::PinsFaults pins_faults() const { return pins_.faults(); }

  private:
    VirtualMachine(const twin::Machine& machine, board::linux::PinsServer pins);
    /// Plays everything that was pushed before the call, and returns the instant that the twin has
    /// reached.
    Instant drain();

    board::linux::PinsServer pins_;
    twin::Printer printer_;
    InspectService service_;
    std::unique_ptr<InspectServer> socket_;
};

}  // namespace qduino::apps
