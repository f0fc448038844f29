// The most CPU time that executions took in any window of one length: what a handler needs of its
// VCPU. One run says too little, for edges come in bursts; the shortest gap says too much, for a
// burst ends.
//
//   runs     █    █ █ █            █
//            └─ window ─┘                the sum over the runs that began in it
//
// It remembers a bounded number of runs. When there are more in one window, the two oldest count as
// one that began as late as the later: the sum is then too high, never too low.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "base/time.h"

namespace qduino::runtime {

/// One owner at a time. No call blocks or allocates.
class BusiestWindow {
  public:
    static constexpr std::size_t kRunsKept = 64;

    /// 0: nothing is added up.
    explicit BusiestWindow(Nanoseconds length) : length_(length) {}

    /// A run that began at `began`, not before the last one, took `cpu`.
    void add(Instant began, Nanoseconds cpu) {
        if (length_ == Nanoseconds{0}) return;
        while (count_ > 0 && oldest().began + length_ <= began) forget();
        if (count_ == kRunsKept) {
            const Nanoseconds merged = oldest().cpu;
            forget();
            oldest().cpu += merged;
            sum_ += merged;
        }
        runs_[(first_ + count_++) % kRunsKept] = {began, cpu};
        sum_ += cpu;
        most_ = std::max(most_, sum_);
    }
    [[nodiscard]] Nanoseconds most() const { return most_; }

  private:
    struct Run {
        Instant began;
        Nanoseconds cpu{};
    };
    [[nodiscard]] Run& oldest() { return runs_[first_]; }
    void forget() {
        sum_ -= oldest().cpu;
        first_ = (first_ + 1) % kRunsKept;
        --count_;
    }

    Nanoseconds length_;
    std::array<Run, kRunsKept> runs_{};
    std::size_t first_ = 0, count_ = 0;
    Nanoseconds sum_{}, most_{};
};

}  // namespace qduino::runtime
