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
// Before the first motion, on the core and the thread that will play: loop 2's. Some 10 ms. No
// heap.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

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

/// The time of one step. Every STEP must be low and every DIR positive, as the player leaves them
/// when it is made. By loop 2, before it plays.
template <StepPins Pins>
[[nodiscard]] Nanoseconds measure_step_cost(Pins& pins) {
    constexpr int kBatches = 41;
    constexpr int kSteps = 240;
    channel::RingBuffer<StepEvent, 256> ring;
    MuffledPins<Pins> muffled{pins};
    const PlayerSettings at_once{.pulse = {}, .low = {}, .direction = {}, .late_threshold = 1us, .lead = {}};
    Player<MuffledPins<Pins>, decltype(ring)> player{muffled, ring, at_once};
    std::array<Nanoseconds, kBatches> batches{};
    for (Nanoseconds& batch : batches) {
        for (int i = 0; i < kSteps; ++i) {
            static_cast<void>(ring.try_push({.time_ns = i, .kind = EventKind::step}));
        }
        const Instant begin = pins.now();
        player.play_until(kForever);
        batch = (pins.now() - begin) / kSteps;
    }
    std::ranges::nth_element(batches, batches.begin() + kBatches / 2);
    return batches[kBatches / 2];
}

}  // namespace qduino::printer::step
