// What a step costs on this computer: the time that the player takes for one, rising and falling
// edge, when nothing makes it wait.
//
// The real player plays made-up steps of one axis with no times to keep: each pulse ends before the
// next begins, so no two edges share a write. Its pins are the real ones behind a muffler: every
// write repeats the level that the pin has at rest, so the driver does all its work and no motor
// sees an edge.
//
//   batch of 240 steps ── time / 240 ──┐
//   batch …                            ├─► the median: what else took the core is in some of them
//   41 batches                         ┘
//
// Before the first motion, on the core and the thread that will play: loop 2's. Some 10 ms in all.
// A stop must not wait for that, so there is one batch in each pass of the loop. No heap.
#pragma once

#include <algorithm>
#include <cstddef>

#include "base/fixed_vector.h"
#include "channel/ring_buffer.h"
#include "printer/step/player.h"

namespace qduino::printer::step {

/// Writes each pin at its level of rest, whatever the player wants.
template <StepPins Pins>
class MuffledPins {
  public:
    explicit MuffledPins(Pins& pins) : pins_(pins) {}
    [[nodiscard]] Instant now() { return pins_.now(); }
    void busy_until(Instant t) { pins_.busy_until(t); }
    void set_steps(const MotorList& motors, bool) { pins_.set_steps(motors, false); }
    void set_direction(int axis, bool) { pins_.set_direction(axis, true); }
    [[nodiscard]] bool endstop_pressed(int) { return false; }
    void watch_switches(int, bool) {}

  private:
    Pins& pins_;
};

/// By loop 2, before it plays.
class StepCost {
  public:
    /// Measures one batch. Every STEP must be low and every DIR positive, as the player leaves them
    /// when it is made. Contract: not done().
    template <StepPins Pins>
    void measure(Pins& pins) {
        channel::RingBuffer<StepEvent, 256> ring;
        MuffledPins<Pins> muffled{pins};
        const PlayerSettings at_once{
            .pulse = {}, .low = {}, .direction = {}, .late_threshold = 1us, .lead = {}};
        Player<MuffledPins<Pins>, decltype(ring)> player{muffled, ring, at_once};
        for (int i = 0; i < kSteps; ++i) {
            static_cast<void>(ring.try_push({.time_ns = i, .kind = EventKind::step}));
        }
        const Instant begin = pins.now();
        player.play_until(kForever);
        batches_.push_back((pins.now() - begin) / kSteps);
    }
    /// Nothing is left to measure.
    [[nodiscard]] bool done() const { return batches_.full(); }
    /// The time of one step, by the batches so far; 0: none was measured.
    [[nodiscard]] Nanoseconds one_step() {
        if (batches_.empty()) return Nanoseconds{0};
        const auto middle = static_cast<std::ptrdiff_t>(batches_.size() / 2);
        std::ranges::nth_element(batches_, batches_.begin() + middle);
        return batches_[batches_.size() / 2];
    }

  private:
    static constexpr int kBatches = 41;
    static constexpr int kSteps = 240;
    FixedVector<Nanoseconds, kBatches> batches_;
};

}  // namespace qduino::printer::step
