// Whether a process of the printer that has ended is started again, and when.
//
//   it was killed, or crashed            again: after 0.2 s, then twice as long each time, 5 s at most
//   it ended by itself with an error     it has said why. Once it may be the moment's trouble; three times in a row, each before
//   it was ready                         it was ready, is no moment's trouble: given up, and with it the printer
//   it never was ready at all            given up at once: what it said stands on the screen, and nothing runs yet
//   it ended with 0                      it was asked to
//
// Pure: time is a parameter.
#pragma once

#include <optional>

#include "base/time.h"

namespace qduino::launcher {

/// How a process ended.
struct Ended {
    bool by_signal = false;
    int status = 0;          ///< exit status, or the signal's number
    bool was_ready = false;  ///< it had come up, this time
    /// By a signal, or it says so of its own child, as a shell does (the supervisor of its sketch).
    [[nodiscard]] bool killed() const { return by_signal || status > 128; }
};

class RestartPolicy {
  public:
    static constexpr Nanoseconds kFirstPause = 200ms;
    static constexpr Nanoseconds kLastPause = 5s;
    static constexpr int kErrorsInARow = 3;
    /// After so long a life the pauses begin at the first one again.
    static constexpr Nanoseconds kGoodLife = 10s;

    /// The pause before it is started again; nothing: it is given up.
    [[nodiscard]] std::optional<Nanoseconds> on_end(const Ended& ended, Nanoseconds lived);

  private:
    Nanoseconds pause_ = kFirstPause;
    int errors_in_a_row_ = 0;
    bool ever_ready_ = false;
};

}  // namespace qduino::launcher
