// The last thing a dying sketch does: force its safe states.
//
//   SIGSEGV SIGBUS SIGILL SIGFPE SIGABRT, a broken contract ──► last_will() ──► die as before
//   SIGINT SIGTERM  ──► stop(), the loops return, run() applies the safe states; a loop that does not return
//   within
//                       kStopGrace, or a second signal ──► last_will(), exit
//
// SIGKILL and a hang leave no time for a will: for those there is the supervisor, which outlives the sketch.
#pragma once

#include <csignal>

namespace qduino::board::linux {

inline constexpr unsigned kStopGraceSeconds = 3;

/// Both functions run in signal handlers: they must be async-signal-safe. `context` is handed to them.
struct Will {
    void (*last_will)(void* context) = nullptr;
    void (*stop)(void* context) = nullptr;
    void* context = nullptr;
};

/// Installs the handlers while it lives; there can be one at a time. Setup-time.
class FatalSignals {
  public:
    explicit FatalSignals(Will will);
    ~FatalSignals();
    FatalSignals(const FatalSignals&) = delete;
    FatalSignals& operator=(const FatalSignals&) = delete;
};

/// Gives the calling thread a stack for its signal handlers (its own may be what overflowed), while it lives.
class SignalStack {
  public:
    SignalStack();
    ~SignalStack();
    SignalStack(const SignalStack&) = delete;
    SignalStack& operator=(const SignalStack&) = delete;

  private:
    void* memory_ = nullptr;
};

/// Blocks the signals that ask for a stop in the calling thread, for as long as it lives: threads made
/// meanwhile leave them to the main thread.
class StopSignalsBlocked {
  public:
    StopSignalsBlocked();
    ~StopSignalsBlocked();
    StopSignalsBlocked(const StopSignalsBlocked&) = delete;
    StopSignalsBlocked& operator=(const StopSignalsBlocked&) = delete;

  private:
    sigset_t before_{};
};

}  // namespace qduino::board::linux
