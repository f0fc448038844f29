// How long bottom halves take to come, and to be done, counted from the edge or interrupt that they
// are for.
//
//   edge ───── to_begin ─────► handler's first instruction ───► handler's end
//     └──────────────────── to_end ───────────────────────────────┘
//
// A board records them where it runs handlers. Beside what admission promises of the I/O VCPU
// (sched::IoResponse) they are in the guarantee report.
#pragma once

#include "base/histogram.h"
#include "board/guarantee.h"

namespace qduino::board {

/// The times of one I/O VCPU's handlers. One writer; read it when its VCPU has ended.
class HandlerTimes {
  public:
    /// A handler for what came at `came` (kForever: nobody knows when) ran from `began` to `ended`.
    void record(Instant came, Instant began, Instant ended) {
        if (came == kForever) {
            ++untimed_;
            return;
        }
        to_begin_ns_.record((began - came).count());
        to_end_ns_.record((ended - came).count());
    }
    /// Nothing happened yet.
    [[nodiscard]] bool empty() const { return to_begin_ns_.count() + untimed_ == 0; }
    /// As a line of the guarantee, without a promise.
    [[nodiscard]] BottomHalfGuarantee describe(VcpuId id, int core) const {
        const auto of = [](std::uint64_t ns) { return Nanoseconds{static_cast<std::int64_t>(ns)}; };
        return {.id = id,
                .core = core,
                .timed = to_begin_ns_.count(),
                .untimed = untimed_,
                .begin_median = of(to_begin_ns_.quantile(0.5)),
                .begin_p999 = of(to_begin_ns_.quantile(0.999)),
                .begin_worst = of(to_begin_ns_.max()),
                .end_worst = of(to_end_ns_.max())};
    }

  private:
    Histogram to_begin_ns_;
    Histogram to_end_ns_;
    std::uint64_t untimed_ = 0;
};

}  // namespace qduino::board
