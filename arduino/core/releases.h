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

/// Says that what goes on is meant: a wait in setup(), in a handler, or in a loop that promised to
/// get on. The time in which it must be heard of again begins anew. A wait for a button is
/// `while (digitalRead(2) == LOW) { delay(5); progress(); }`.
inline void progress() { qduino::board::current().note_progress(); }

/// promiseProgress(id, limit): loop `id` begins a release or calls progress() every `limit`, or it
/// hangs: the supervisor then ends the sketch through its safe states. It counts the supervisor's
/// own bound (1 s) at least. 0: the loop may take as long as it likes. Without this call a loop
/// that waits for its periods has 10 of them, and 5 s at least, and any other is free. Setup-time,
/// or from the loop itself. The unit of a plain number is TIME_UNIT's (the macro passes it).
template <typename Limit>
void promiseProgress(qduino::arduino::TimeUnit unit, int id, Limit limit) {
    if (auto* runtime = qduino::runtime::Runtime::current())
        runtime->promise_progress(static_cast<std::uint8_t>(id), qduino::arduino::to_duration(unit, limit));
}

/// The board forces `pin` to `level` when the sketch dies, hangs or is stopped. Setup-time. True
/// when the board will do so.
bool safeState(int pin, int level);

/// Ends the program through its safe states.
inline void stopSketch() { qduino::board::current().request_stop(); }
