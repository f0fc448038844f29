// The budget and period that one thread, or process, asks of another: the latest alone counts.
//
//   writer   number odd ─► both values ─► number even, higher
//   reader   number ─► both values ─► the same number still? else there is nothing to take yet
//
// A sequence lock: the two values are more than one atomic word. Nobody waits: a reader that comes
// in the middle of a write takes the values up the next time. All zeroes is an empty one. A value
// is stored with release and loaded with acquire: a reader that got a new one finds the number odd,
// or higher.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

#include "sched/vcpu.h"

namespace qduino::board::linux {

class ParametersMail {
  public:
    /// One writer at a time.
    void put(sched::VcpuParameters parameters) {
        const std::uint32_t number = number_.load(std::memory_order_relaxed);
        number_.store(number + 1, std::memory_order_relaxed);
        budget_ns_.store(parameters.budget.count(), std::memory_order_release);
        period_ns_.store(parameters.period.count(), std::memory_order_release);
        number_.store(number + 2, std::memory_order_release);
    }
    /// What was put last, unless that is number `seen`, which is raised to it. Nothing while a
    /// write is under way.
    [[nodiscard]] std::optional<sched::VcpuParameters> take(std::uint32_t& seen) const {
        const std::uint32_t number = number_.load(std::memory_order_acquire);
        if (number == seen || number % 2 != 0) return std::nullopt;
        const sched::VcpuParameters parameters{Nanoseconds{budget_ns_.load(std::memory_order_acquire)},
                                               Nanoseconds{period_ns_.load(std::memory_order_acquire)}};
        if (number_.load(std::memory_order_relaxed) != number) return std::nullopt;
        seen = number;
        return parameters;
    }

  private:
    std::atomic<std::uint32_t> number_{0};
    std::atomic<std::int64_t> budget_ns_{0};
    std::atomic<std::int64_t> period_ns_{0};
};

}  // namespace qduino::board::linux
