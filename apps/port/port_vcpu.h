// The I/O VCPU of a serial host's port, as the process that carries its bytes keeps it.
//
// The sketch declares it (interruptsVcpu(UART, …)), so its budget is in the admission. The kernel
// gives the bytes to an ordinary process, and that has no timer of ours. So this process takes the
// rank that the sketch publishes in its link, and keeps the PIBS budget (sched/pibs.h) itself:
//
//   poll ─► begin() ─► read, scan, pass on ─► end()          all CPU time since the last end()
//             └─ sleeps until (eligible + used/U)   └─ charged
//
// A turn is short and bounded, so an M112 waits for budget for at most one period of the client:
// loop 3's 8 ms. Should a turn never end, the kernel takes the rank
// (board/linux/kernel/importance.h).
#pragma once

#include <optional>

#include "printer/link/layout.h"
#include "sched/pibs.h"

namespace qduino::port {

class PortVcpu {
  public:
    /// What the sketch has published now; null: there is none. Takes its rank, or gives it back.
    void follow(const printer::link::PortVcpu* published);
    /// Sleeps until the budget has come back.
    void begin();
    /// Charges what this thread has used.
    void end();

    /// From begin() to begin() at least, after `used`; 0 without a budget.
    [[nodiscard]] Nanoseconds recovery_of(Nanoseconds used) const;

  private:
    printer::link::PortPlace place_{};
    std::optional<sched::Pibs> server_;
    Nanoseconds cpu_{};  // of this thread, charged
};

}  // namespace qduino::port
