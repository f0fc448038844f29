// Samples that a real-time child takes and its parent reads: one block of memory shared by both,
// faulted in before the child runs.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "board/linux/pin/pins_file.h"
#include "posix/mapping.h"

namespace qduino::bench {

class SharedSamples {
  public:
    /// Room for `capacity` samples; further ones are dropped. Ends the program when memory is
    /// short.
    explicit SharedSamples(std::size_t capacity);

    /// One writer. Real-time safe.
    void push(std::int64_t sample) {
        const std::size_t count = head_->count.load(std::memory_order_relaxed);
        if (count == capacity_) return;
        values_[count] = sample;
        head_->count.store(count + 1, std::memory_order_release);
    }
    [[nodiscard]] bool full() const { return head_->count.load(std::memory_order_relaxed) == capacity_; }
    [[nodiscard]] std::vector<std::int64_t> taken() const {
        return {values_, values_ + head_->count.load(std::memory_order_acquire)};
    }

  private:
    struct Head {
        std::atomic<std::size_t> count;
    };
    posix::Mapping memory_;
    std::size_t capacity_;
    Head* head_;
    std::int64_t* values_;
};

/// The smallest of `sorted` that at least the share `q` (0…1) of them do not exceed; 0 for none.
std::int64_t percentile(std::span<const std::int64_t> sorted, double q);

/// Differences of neighbours, in ascending order of size.
std::vector<std::int64_t> sorted_intervals(std::span<const std::int64_t> instants);

}  // namespace qduino::bench
