// Loop 2's work: stops first, then what loop 1 and the service want to know, then every pulse at
// its instant.
//
//   step() ─► stops ─► status ─► pulses due within 100 µs ─► spin, or nap
//
// Loops 1 and 3 are told the counts every 10 ms. The service shows ten pictures a second at most,
// and its status holds a histogram: it is told every 100 ms.
//
// Telling takes time, and so does the way out of step() and back in (the runtime keeps its accounts
// there): some hundred instructions each, several microseconds on a slow processor. A pulse that is
// due meanwhile would be late. So both happen in a pause, where nothing is due for 20 µs:
//
//   slice    |<------ 60 µs ------>|<--- 40 --->|      returns at the first pause behind 60 µs
//   pulses    ‾ _ ‾ _ ‾ _ ‾ _ ‾ _ ‾ _ ‾ _     ‾ _
//                                        ^ returns
//
// Where pulses are too dense for that, 5 µs are a pause from 100 µs on: long enough to come back.
// Without one it plays on for a millisecond, and looks for stops every 100 µs as ever. The loops
// are told 10 ms later in any case, and the service, whose status takes longest, 100 ms later.
//
// A nap ends 500 µs before the next pulse: what is left is spun, so that a late wake-up delays
// nothing. It lasts 1 ms at most: a stop is served within that. The spin looks for stops every
// 100 µs, too, and does not leave step() for it.
//
// A stop is served once for each number: asked for, served, published at once, because loop 1 waits
// for the answer. While an emergency stop has not reached loop 1 yet, what it still pushes is
// dropped too.
//
// An emergency stop ends the heat as well. Loop 3 sees the same word of the link and latches the
// fault, but it samples every 8 ms only. Loop 2 looks every 100 µs, so it drives the heaters off
// itself, and again each time that it looks until loop 1 has taken the stop: a sample of loop 3
// that was under way may still have written a duty.
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

/// What loop 2 needs beside the player's pins.
template <class P>
concept LoopPins = StepPins<P> && requires(P& pins, Instant t) {
    { pins.sleep_until(t) } -> std::same_as<void>;
    /// Every heater's output to its safe level, whatever loop 3 wants.
    { pins.cut_heat() } -> std::same_as<void>;
};

template <LoopPins Pins, class Ring, StopSource Stops>
class StepperLoop {
  public:
    using Loops = channel::Broadcast<link::MotionCounts, 2>;  ///< loop 1, loop 3
    using Service = channel::FourSlot<link::MotionStatus>;

    /// `pins`, `ring`, `stops`, the readers of `loops` and `service` outlive the loop.
    StepperLoop(Pins& pins, Ring& ring, const Stops& stops, const Loops& loops, Service& service,
                const PlayerSettings& settings)
        : pins_(pins), stops_(stops), loops_(loops), service_(service), player_(pins, ring, settings) {}

    /// One slice, again and again: returns after 1 ms at most.
    void step() {
        serve_stops();
        const Instant start = pins_.now();
        if (start >= loops_due_) tell(start);
        Instant due = player_.play_to_pause(start + kPausesFrom, start + kSlice, kPause);
        for (Instant end = start + 2 * kSlice; end <= start + kSliceMax; end += kSlice) {
            if (due - kShortPause >= pins_.now()) break;
            serve_stops();
            due = player_.play_to_pause(kEpoch, end, kShortPause);
        }
        const Instant nap_end = std::min(due == kForever ? kForever : due - kSleepBelowDue, start + kIdleNap);
        if (nap_end > start + kSlice) {
            pins_.sleep_until(nap_end);
        } else {
            spin_towards(due - kPause, start);
        }
    }

  private:
    static constexpr Nanoseconds kSlice = 100us;  // one call in motion
    static constexpr Nanoseconds kPausesFrom = 60us;
    static constexpr Nanoseconds kPause = 20us;      // long enough to tell, and to come back
    static constexpr Nanoseconds kShortPause = 5us;  // … to come back
    static constexpr Nanoseconds kSliceMax = 1ms;
    // How long before a step the loop wakes; it spins the rest.
    static constexpr Nanoseconds kSleepBelowDue = 500us;
    static constexpr Nanoseconds kIdleNap = 1ms;
    static constexpr Nanoseconds kTellLoopsEvery = 10ms;
    static constexpr Nanoseconds kTellServiceEvery = 100ms;

    /// To `end`, in slices from `start` on, with a look at the stops between two; as long as one
    /// call may take at most.
    void spin_towards(Instant end, Instant start) {
        for (Instant look = start + kSlice;; look += kSlice) {
            pins_.busy_until(std::min(end, look));
            if (end <= look || look >= start + kSliceMax || serve_stops()) return;
        }
    }

    /// True: there was one.
    bool serve_stops() {
        const std::uint32_t asked = stops_.stop_asked();
        const bool emergency = stops_.emergency_pending();
        if (asked == stops_served_ && !emergency) return false;
        player_.stop_now();
        if (emergency) pins_.cut_heat();
        // Allowed again before loop 1 hears that it was served: what it pushes after that is meant
        // to be played.
        if (!stops_.emergency_pending()) player_.allow_motion();
        stops_served_ = asked;
        loops_due_ = kEpoch;  // loop 1 waits for the answer
        return true;
    }

    /// What is due, if nothing else is before `now` + kPause, or if it has waited long enough.
    void tell(Instant now) {
        const bool in_pause = player_.next_due() - kPause >= now;
        if (!in_pause && now < loops_due_ + kTellLoopsEvery) return;
        const link::MotionStatus& status = player_.publish(stops_served_);
        loops_.write(status);
        loops_due_ = now + kTellLoopsEvery;
        if (now < (in_pause ? service_due_ : service_due_ + kTellServiceEvery)) return;
        service_.write(status);
        service_due_ = now + kTellServiceEvery;
    }

    Pins& pins_;
    const Stops& stops_;
    Loops loops_;
    Service& service_;
    Player<Pins, Ring> player_;
    std::uint32_t stops_served_ = 0;
    Instant loops_due_ = kEpoch;
    Instant service_due_ = kEpoch;
};

}  // namespace qduino::printer::step
