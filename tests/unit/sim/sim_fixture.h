// What the tests of the simulator share: entries written as lambdas, and a trace that is kept and
// can be added up.
#pragma once

#include <functional>
#include <list>
#include <ostream>
#include <vector>

#include "board/peripherals.h"
#include "board/sim/sim_board.h"

namespace qduino {

/// Found by GoogleTest: instants in its messages.
inline void PrintTo(Instant t, std::ostream* out) { *out << to_ns(t) << " ns"; }

}  // namespace qduino

namespace qduino::board::sim::testing {

inline constexpr Instant at(Nanoseconds since_start) { return kEpoch + since_start; }

class KeptTrace final : public TraceSink {
  public:
    void on_event(const TraceEvent& event) override { events.push_back(event); }
    [[nodiscard]] std::size_t count(TraceKind kind, VcpuId vcpu) const {
        std::size_t n = 0;
        for (const TraceEvent& event : events) n += event.kind == kind && event.vcpu == vcpu;
        return n;
    }

    /// A stretch of time for which a core was a VCPU's.
    struct Burst {
        Instant begin;
        Instant end;
        friend bool operator==(const Burst&, const Burst&) = default;
    };
    /// All bursts of `vcpu`, in order; one that had not ended is left out.
    [[nodiscard]] std::vector<Burst> bursts(VcpuId vcpu) const {
        std::vector<Burst> found;
        Instant begin = kForever;  // forever: it does not run
        for (const TraceEvent& event : events) {
            if (event.vcpu != vcpu || event.kind == TraceKind::interrupt) continue;
            if (event.kind == TraceKind::run) begin = event.time;
            const bool ends = event.kind == TraceKind::preempt || event.kind == TraceKind::block ||
                              event.kind == TraceKind::throttle || event.kind == TraceKind::finish;
            if (!ends || begin == kForever) continue;
            if (event.time > begin) found.push_back({begin, event.time});
            begin = kForever;
        }
        return found;
    }

    std::vector<TraceEvent> events;
};

/// VcpuSpecs whose entries are lambdas. Lives as long as the board.
class Program {
  public:
    using Body = std::function<void()>;

    Program& loop(VcpuId id, Nanoseconds budget, Nanoseconds period, int core, Body body) {
        bodies_.push_back(std::move(body));
        specs_.push_back({{id, budget, period, core}, false, false, &Program::call, &bodies_.back()});
        return *this;
    }
    Program& owning_loop(VcpuId id, Nanoseconds period, int core, Body body) {
        loop(id, period, period, core, std::move(body));
        specs_.back().owns_core = true;
        return *this;
    }
    Program& io(VcpuId id, Nanoseconds budget, Nanoseconds period, int core) {
        specs_.push_back({{id, budget, period, core, VcpuKind::io}});
        return *this;
    }
    [[nodiscard]] std::span<const VcpuSpec> specs() const { return specs_; }

  private:
    static void call(void* body) { (*static_cast<Body*>(body))(); }
    std::list<Body> bodies_;
    std::vector<VcpuSpec> specs_;
};

/// Runs `cost` of CPU time in every period from the epoch on, until the board stops.
inline Program::Body periodic_work(SimBoard& board, Nanoseconds cost, Nanoseconds period,
                                   std::function<void(Instant release, Instant end)> done = {}) {
    return [&board, cost, period, done] {
        Instant release = kEpoch;
        while (!board.stop_requested()) {
            board.compute(cost);
            if (done) done(release, board.now());
            release += period;
            board.sleep_until(release);
        }
    };
}

}  // namespace qduino::board::sim::testing
