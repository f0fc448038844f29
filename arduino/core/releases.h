// A loop's control of its own releases, and the pins' safe states for when the sketch cannot act.
#pragma once

#include "arduino/core/loops.h"
#include "runtime/runtime.h"

using qduino::runtime::OverrunPolicy;

/// Ends this release; returns when the next one starts: one period after this one's nominal start,
/// so without drift.
inline void waitForNextPeriod() {
    if (auto* runtime = qduino::runtime::Runtime::current()) runtime->wait_for_next_period();
}

/// Sets the policy for an overrun of loop `id` (OverrunPolicy: skip, catch_up, keep_phase,
/// call_back, stop). `handler` gets the loop and its lateness. Setup-time, or from the loop itself.
inline void overrunPolicy(int id, OverrunPolicy policy,
                          void (*handler)(std::uint8_t id, std::chrono::nanoseconds lateness) = nullptr) {
    if (auto* runtime = qduino::runtime::Runtime::current())
        runtime->set_overrun_policy(static_cast<std::uint8_t>(id), policy, handler);
}

/// The board forces `pin` to `level` when the sketch dies, hangs or is stopped. Setup-time. True
/// when the board will do so.
bool safeState(int pin, int level);

/// Ends the program through its safe states.
inline void stopSketch() { qduino::board::current().request_stop(); }
