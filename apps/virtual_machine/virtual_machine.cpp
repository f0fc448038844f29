#include "apps/virtual_machine/virtual_machine.h"

#include <utility>

#include "board/linux/kernel/clock.h"

namespace qduino::apps {

using board::linux::monotonic_now;
using board::linux::PinsServer;

VirtualMachine::VirtualMachine(const twin::Machine& machine, PinsServer pins)
    : pins_(std::move(pins)), printer_(machine), service_(printer_, [this] { return drain(); }) {}

Result<std::unique_ptr<VirtualMachine>> VirtualMachine::create(const VirtualMachineOptions& options) {
    QDUINO_TRY_ASSIGN(PinsServer pins, PinsServer::create(options.pins, options.own_clock));
    std::unique_ptr<VirtualMachine> made(new VirtualMachine(options.machine, std::move(pins)));
    QDUINO_TRY_ASSIGN(made->socket_, serve_inspector(options.inspect, made->service_));
    const Instant start = made->pins_.now();
    for (twin::Fault fault : options.faults) {
        fault.at = start + fault.at.time_since_epoch();
        made->printer_.inject(fault);
    }
    return made;
}

void VirtualMachine::pass() {
    if (pins_.poll(pins_.past(), printer_) == 0) pins_.wait(kPass);
    if (socket_) socket_->poll();
}

Instant VirtualMachine::drain() {
    const Instant asked = pins_.now();
    // A writer that stopped in mid-write holds the horizon back for a few milliseconds, no longer.
    const Instant patience = monotonic_now() + Nanoseconds{100'000'000};
    while (pins_.horizon() < asked && monotonic_now() < patience) pins_.poll(pins_.now(), printer_);
    return pins_.horizon();
}

}  // namespace qduino::apps
