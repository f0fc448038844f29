#include "spool/host_keeper.h"

#include <string>
#include <utility>

namespace qduino::spool {

using printer::link::Command;

Result<void> HostKeeper::claim() {
    if (has_printer_) return {};
    if (runs_.busy()) {
        const Job* job = runs_.active() ? ledger_.queue().find(runs_.active()->job) : nullptr;
        return make_error(ErrorCode::not_permitted, "the printer is printing ",
                          job ? words_of(*job) : "a job of its queue",
                          ": wait for its end, or cancel it on the page");
    }
    const std::string& held = ledger_.gate().hold_reason;
    QDUINO_TRY(ledger_.hold_queue(std::string{held.empty() ? kHasPrinter : held}));
    QDUINO_TRY(machine_.push(Command::host_line));
    has_printer_ = true;
    ledger_.log().add(kHasPrinter, ": no job begins until it has gone");
    return {};
}

Result<void> HostKeeper::line(std::string_view line, HostClaim claims) {
    QDUINO_TRY(machine_.check_connected());
    if (claims == HostClaim::printer) QDUINO_TRY(claim());
    return machine_.push(Command::host_line, line);
}

void HostKeeper::leaves() {
    if (!std::exchange(has_printer_, false)) return;
    const QueueGate& gate = ledger_.gate();
    const bool ours = gate.hold_reason == kHasPrinter;
    const std::string reason = !ours                  ? gate.hold_reason
                               : options_.confirm_bed ? std::string{}
                                                      : "a serial host has used the printer";
    ledger_.log().add("the serial host has gone");
    // If it fails, the queue stays held, and a person may release it.
    static_cast<void>(
        ledger_.try_commit({.gate = QueueGate{reason, options_.confirm_bed || gate.bed_occupied}}));
}

}  // namespace qduino::spool
