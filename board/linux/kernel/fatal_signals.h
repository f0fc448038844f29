// The last thing a dying sketch does: it forces its safe states.
//
//   SIGSEGV SIGBUS SIGILL SIGFPE SIGABRT, or a broken contract
//       ──► last_will() ──► the process dies of the same cause
//
//   SIGINT, SIGTERM
//       ──► stop(): the loops return, and run() applies the safe states
//       ──► if they have not within kStopGraceSeconds, or at a second signal: last_will(), exit
//
// SIGKILL and a hang leave no time for a will. For those there is the supervisor, which outlives
// the sketch.
#pragma once

#include <csignal>

namespace qduino::board::linux {

inline constexpr unsigned kStopGraceSeconds = 3;

/// Both functions run in signal handlers: they must be async-signal-safe. `context` is handed to
/// them.
struct Will {
    void (*last_will)(void* context) = nullptr;
    void (*stop)(void* context) = nullptr;
    void* context = nullptr;
    /// Says why, after the will, on the thread that got the signal. It may take some time; null:
    /// nothing is said.
    void (*last_words)(int signal, const siginfo_t* info, const void* machine_context) = nullptr;
};

/// Installs the handlers while it lives; there can be one at a time. Setup-time.
class FatalSignals {
  public:
    explicit FatalSignals(Will will);
    ~FatalSignals();
    FatalSignals(const FatalSignals&) = delete;
    FatalSignals& operator=(const FatalSignals&) = delete;
};

/// Blocks the stop signals in the calling thread while it lives. Threads made meanwhile inherit
/// that, so the main thread gets the signals.
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
