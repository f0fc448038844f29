// The newest events, kept back for as long as a step that follows may yet undo one of them.
//
//        known so far
//   -----------------------|gap|                       a step of the same motor, the other way and
//    given out             |kept                       nearer than the gap: neither is made
//
// Pure, no heap. 64 KB. No event is ever reordered.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "printer/step/step_event.h"

namespace qduino::printer::step {

class StepTail {
  public:
    static constexpr std::size_t kCapacity = 4096;
    /// More than may come at once, after is_filled() was asked.
    static constexpr std::size_t kReserve = 1040;

    [[nodiscard]] std::size_t size() const { return end_ - begin_; }
    [[nodiscard]] bool empty() const { return begin_ == end_; }
    /// The oldest must go, gap or not.
    [[nodiscard]] bool is_filled() const { return size() + kReserve > kCapacity; }
    [[nodiscard]] const StepEvent& front() const { return events_[begin_ % kCapacity]; }
    void push(const StepEvent& event) { events_[end_++ % kCapacity] = event; }
    void pop() { ++begin_; }
    void clear() { begin_ = end_; }

    /// Takes the last step of `axis` out, if it goes against `direction` and is nearer to `time_ns`
    /// than `gap_ns`. Not across a homing switch: only the player will know which steps before it
    /// are really made.
    [[nodiscard]] bool take_back(int axis, int direction, std::int64_t time_ns, std::int64_t gap_ns) {
        for (std::size_t at = end_; at != begin_;) {
            const StepEvent& kept = events_[--at % kCapacity];
            if (kept.kind == EventKind::homing || time_ns - kept.time_ns >= gap_ns) return false;
            if (kept.kind != EventKind::step || kept.axis != axis) continue;
            if (kept.direction == direction) return false;
            for (; at + 1 != end_; ++at) events_[at % kCapacity] = events_[(at + 1) % kCapacity];
            --end_;
            return true;
        }
        return false;
    }

  private:
    std::array<StepEvent, kCapacity> events_{};
    std::size_t begin_ = 0;  // counts of entries ever taken out, and put in
    std::size_t end_ = 0;
};

}  // namespace qduino::printer::step
