// A serial host's claim on the printer. Jobs and a host exclude each other: a line that claims the
// printer is refused while a job is printed, and no job begins until the host has gone.
//
// The claim is durable, as a hold of the queue: a service that is killed meanwhile must not begin a
// job on what the host has printed.
#pragma once

#include <cstdint>
#include <string_view>

#include "base/result.h"
#include "spool/ledger.h"
#include "spool/machine_link.h"
#include "spool/run_keeper.h"

namespace qduino::spool {

/// How a serial host's lines cross the link.
enum class HostClaim : std::uint8_t {
    none,     ///< a question, or what may be done beside a job
    printer,  ///< the line moves or waits: the host has the printer from here on
};

class HostKeeper {
  public:
    static constexpr std::string_view kHasPrinter = "a serial host has the printer";

    /// All outlive this.
    HostKeeper(const SpoolOptions& options, Ledger& ledger, MachineLink& machine, const RunKeeper& runs)
        : options_(options), ledger_(ledger), machine_(machine), runs_(runs) {}

    [[nodiscard]] bool has_printer() const { return has_printer_; }
    /// Errors: not_permitted, and as MachineLink::push().
    [[nodiscard]] Result<void> line(std::string_view line, HostClaim claim);
    /// It has gone. What it printed may still be on the bed.
    void leaves();

  private:
    [[nodiscard]] Result<void> claim();

    const SpoolOptions& options_;
    Ledger& ledger_;
    MachineLink& machine_;
    const RunKeeper& runs_;
    bool has_printer_ = false;
};

}  // namespace qduino::spool
