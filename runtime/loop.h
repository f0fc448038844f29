// One loop at run time: its release clock, its policy, and its counters.
//
// wait_for_next_period() ends a release:
//
//   body returns to the call ── now ──► late? ── no ────────────────────────► wait ──► next release
//                                         │ yes                                ▲
//                                         └► count, then by policy: skip,      │
//                                            catch_up, keep_phase, call_back   │
//                                            (the handler first), stop ────────┘
//
// The loop alone writes the counters. Another thread that reads them meanwhile gets each one whole,
// but not all of the same instant. Read the histogram when the loop has ended.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/histogram.h"
#include "base/time.h"
#include "runtime/chain_watch.h"
#include "runtime/profile.h"
#include "runtime/release_clock.h"
#include "runtime/sketch.h"

namespace qduino::runtime {

/// Called on the loop that overran, before its next release, with how late it ended.
using OverrunHandler = void (*)(board::VcpuId loop, Nanoseconds lateness);

/// A number that one thread counts and any thread may read. No read-modify-write: one writer needs
/// none.
class Counter {
  public:
    void add(std::int64_t amount) { value_.store(get() + amount, std::memory_order_relaxed); }
    void raise_to(std::int64_t value) {
        if (value > get()) value_.store(value, std::memory_order_relaxed);
    }
    [[nodiscard]] std::int64_t get() const { return value_.load(std::memory_order_relaxed); }

  private:
    std::atomic<std::int64_t> value_{0};
};

struct LoopStatistics {
    Counter passes;  ///< times the body was called
    /// Releases begun; under keep_phase without those that ended late.
    Counter releases;
    Counter overruns;         ///< releases that ended after the next was due
    Counter dropped;          ///< releases that were never run
    Counter lateness_ns_max;  ///< worst end after the next was due
    Counter slept_ns_max;     ///< longest sleep within a release
    Counter sleeps_max;       ///< most sleeps within a release
    /// When the release in hand began, on the board's clock; 0: none has.
    Counter release_began_ns;
    Counter ended;                 ///< 1: the board stopped, and the loop's last pass is over
    Histogram release_latency_ns;  ///< from when a release was due to when its code went on
};

class Runtime;

struct Loop {
    Runtime* runtime = nullptr;  ///< that runs it
    LoopDeclaration declaration{};
    bool owns_core = false;
    ReleaseClock clock;
    OverrunPolicy policy = OverrunPolicy::skip;
    OverrunHandler on_overrun = nullptr;
    static constexpr Nanoseconds kRecorded{-1};
    Nanoseconds latency = kRecorded;  ///< of the release in hand, until it is in the statistics
    Nanoseconds slept_before{};       ///< this release: board::Board::slept()
    std::int64_t sleeps_before = 0;   ///< likewise: sleeps()
    /// wait_for_next_period() was called in this pass of the body.
    bool waited = false;
    /// The board knows how long a release may last: the sketch said so, or the default holds.
    bool progress_promised = false;
    LoopStatistics statistics;
    std::unique_ptr<ExecutionProfile> profile;  ///< null: none is asked for
    std::vector<ChainPlace> chains;             ///< where it stands in chains
};

}  // namespace qduino::runtime
