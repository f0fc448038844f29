// Loop 2's work: stops first, then what loop 1 and the service want to know, then every pulse at
// its instant.
//
//   step() ─► stops ─► status (every 10 ms) ─► pulses due within 100 µs ─► spin, or nap
//
// A nap ends 500 µs before the next pulse: what is left is spun, so that a late wake-up delays
// nothing. It lasts 1 ms at most: a stop is served within that.
//
// A stop is served once for each number: asked for, served, published at once, because loop 1 waits
// for the answer. While an emergency stop has not reached loop 1 yet, what it still pushes is
// dropped too.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstdint>

#include "base/time.h"
#include "channel/broadcast.h"
#include "printer/link/layout.h"
#include "printer/step/player.h"

namespace qduino::printer::step {

/// What may ask for a stop. Loop 2 reads both at any time.
template <typename T>
concept StopSource = requires(const T& source) {
    /// Another number than before: drop every step, now.
    { source.stop_asked() } -> std::same_as<std::uint32_t>;
    /// Nothing may move, whatever comes off the ring.
    { source.emergency_pending() } -> std::same_as<bool>;
};

/// `Pins` are the player's, with `sleep_until(Instant)` beside.
template <StepPins Pins, class Ring, StopSource Stops>
class StepperLoop {
  public:
    static constexpr std::size_t kReaders = 3;  ///< loop 1, loop 3, the service
    using Status = channel::Broadcast<link::MotionStatus, kReaders>;

    /// `pins`, `ring`, `stops` and the readers of `status` outlive the loop.
    StepperLoop(Pins& pins, Ring& ring, const Stops& stops, const Status& status,
                const PlayerSettings& settings)
        : pins_(pins), stops_(stops), status_(status), player_(pins, ring, settings) {}

    /// One slice, again and again: returns after 1 ms at most, or after the action that was due
    /// within it.
    void step() {
        serve_stops();
        const Instant start = pins_.now();
        if (start >= publish_due_) publish(start);
        player_.play_until(start + kSlice);
        const Instant due = player_.next_due();
        const Instant nap_end = std::min(due == kForever ? kForever : due - kSleepBelowDue, start + kIdleNap);
        if (nap_end > start + kSlice) {
            pins_.sleep_until(nap_end);
        } else {
            pins_.busy_until(std::min(due, start + kSlice));
        }
    }

  private:
    static constexpr Nanoseconds kSlice = 100us;  // one call in motion
    // How long before a step the loop wakes; it spins the rest.
    static constexpr Nanoseconds kSleepBelowDue = 500us;
    static constexpr Nanoseconds kIdleNap = 1ms;
    static constexpr Nanoseconds kPublishEvery = 10ms;

    void serve_stops() {
        const std::uint32_t asked = stops_.stop_asked();
        if (asked == stops_served_ && !stops_.emergency_pending()) return;
        player_.stop_now();
        // Allowed again before loop 1 hears that it was served: what it pushes after that is meant
        // to be played.
        if (!stops_.emergency_pending()) player_.allow_motion();
        stops_served_ = asked;
        publish_due_ = kEpoch;  // loop 1 waits for the answer
    }

    void publish(Instant now) {
        publish_due_ = now + kPublishEvery;
        status_.write(player_.publish(stops_served_));
    }

    Pins& pins_;
    const Stops& stops_;
    Status status_;
    Player<Pins, Ring> player_;
    std::uint32_t stops_served_ = 0;
    Instant publish_due_ = kEpoch;
};

}  // namespace qduino::printer::step
