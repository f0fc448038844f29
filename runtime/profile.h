// The execution times of a loop's releases, or of a handler's runs: CPU time, and the reason for
// the worst.
//
//   begin()                                          end()
//   incidents ─ CPU clock │ release of the loop │ CPU clock ─ incidents
//
// CPU time and not wall time: what other loops and interrupts take is no part of it. The two
// clocks are read next to the release, so that looking at the incidents costs it nothing; about one
// reading of the CPU clock is in each figure.
//
// One thread writes it. Read it when that has ended.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "base/histogram.h"
#include "base/time.h"
#include "board/board.h"
#include "runtime/busiest_window.h"

namespace qduino::runtime {

/// One release, or one run of a handler.
struct Execution {
    Nanoseconds cpu{};
    std::int64_t number = 0;  ///< from 1; 0: none
    Instant began;
    board::Incidents met;  ///< between begin and end
};

class ExecutionProfile {
  public:
    static constexpr std::size_t kWorstKept = 3;

    /// `window`: for busiest(); 0: nothing.
    explicit ExecutionProfile(Nanoseconds window = {}) : busiest_(window) {}

    void begin(board::Board& board) {
        met_ = board.incidents();
        const Instant now = board.now();
        if (count() > 0) least_gap_ = std::min(least_gap_, now - began_);
        began_ = now;
        cpu_ = board.cpu_time();
    }
    void end(board::Board& board) {
        const Nanoseconds cpu = board.cpu_time() - cpu_;
        length_ns_.record((board.now() - began_).count());
        const board::Incidents met = board.incidents() - met_;
        cpu_ns_.record(cpu.count());
        busiest_.add(began_, cpu);
        throttled_ += met.throttles > 0 ? 1 : 0;
        keep({cpu, count(), began_, met});
    }

    [[nodiscard]] std::int64_t count() const { return static_cast<std::int64_t>(cpu_ns_.count()); }
    [[nodiscard]] const Histogram& cpu_ns() const { return cpu_ns_; }
    /// From begin to end, whoever ran meanwhile.
    [[nodiscard]] const Histogram& length_ns() const { return length_ns_; }
    /// The worst first; those that were not are numbered 0.
    [[nodiscard]] const std::array<Execution, kWorstKept>& worst() const { return worst_; }
    /// Executions in which the budget ended at least once.
    [[nodiscard]] std::int64_t throttled() const { return throttled_; }
    /// The most CPU time of executions that began within one window.
    [[nodiscard]] Nanoseconds busiest() const { return busiest_.most(); }
    /// From one begin to the next; Nanoseconds::max() when there were not two.
    [[nodiscard]] Nanoseconds least_gap() const { return least_gap_; }

  private:
    void keep(Execution execution) {
        for (Execution& kept : worst_) {
            if (kept.number == 0 || execution.cpu > kept.cpu) std::swap(kept, execution);
        }
    }

    Histogram cpu_ns_;
    Histogram length_ns_;
    BusiestWindow busiest_;
    std::array<Execution, kWorstKept> worst_{};
    std::int64_t throttled_ = 0;
    Nanoseconds least_gap_ = Nanoseconds::max();
    board::Incidents met_;
    Instant began_;
    Nanoseconds cpu_{};
};

}  // namespace qduino::runtime
