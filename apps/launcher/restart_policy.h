// Decides whether a process of the printer that has ended is started again, and when.
//
//   it was killed, or had been ready  again: after 0.2 s, then twice as long each time, at most 5 s
//   it ended with an error, not ready again: it said why, and the trouble may pass
//     three times in a row            given up, and with it the printer: this does not pass
//     and never was ready at all      given up at once: its words are on the screen, nothing runs
//   it ended with 0                   not started: it was asked to end
//
// Pure: time is a parameter.
#pragma once

#include <algorithm>
#include <optional>
#include <utility>

#include "base/time.h"

namespace qduino::launcher {

/// How a process ended.
struct Ended {
    bool by_signal = false;
    int status = 0;          ///< exit status, or the signal's number
    bool was_ready = false;  ///< it had come up, this time
    /// It ended by a signal, or reports that its own child did, as a shell does (the supervisor of
    /// its sketch).
    [[nodiscard]] bool killed() const { return by_signal || status > 128; }
};

class RestartPolicy {
  public:
    static constexpr Nanoseconds kFirstPause = 200ms;
    static constexpr Nanoseconds kLastPause = 5s;
    static constexpr int kErrorsInARow = 3;
    /// After a life this long, the pauses begin at the first one again.
    static constexpr Nanoseconds kGoodLife = 10s;

    /// The pause before it is started again; nothing: it is given up.
    [[nodiscard]] std::optional<Nanoseconds> on_end(const Ended& ended, Nanoseconds lived) {
        ever_ready_ = ever_ready_ || ended.was_ready;
        const bool said_why = !ended.killed() && !ended.was_ready;
        errors_in_a_row_ = said_why ? errors_in_a_row_ + 1 : 0;
        if (!ended.killed() && ended.status == 0) return std::nullopt;
        if (said_why && (!ever_ready_ || errors_in_a_row_ >= kErrorsInARow)) return std::nullopt;
        if (lived >= kGoodLife) pause_ = kFirstPause;
        return std::exchange(pause_, std::min(2 * pause_, kLastPause));
    }

  private:
    Nanoseconds pause_ = kFirstPause;
    int errors_in_a_row_ = 0;
    bool ever_ready_ = false;
};

}  // namespace qduino::launcher
