// The first thing that is done about a sketch that is dead, or that was told to die: its machine is made safe, before anything else.
//
//   cut()     at real-time priority   force every output ─► "dead" in the pins file and in the link ─► again as the process
//                                     comes apart, until it is gone (its GPIO lines are free only then): 100 ms at most
//   outlast() at ordinary priority    a process that does not go: kill it and force again, every 100 ms, until it has
//
// The supervisor has a pair of these, and its heat watch another, with a ring of its own.
#pragma once

#include <sys/types.h>

#include <string>

#include "apps/supervisor/system_calls.h"
#include "base/result.h"
#include "base/time.h"
#include "board/linux/safe_outputs.h"

namespace qduino::supervisor {

/// A process that is dying: its pidfd, and its number for words and for the link.
struct Dying {
    int pidfd = -1;
    pid_t pid = 0;
};

class SafeHands {
  public:
    /// `link` may be empty. `file` must outlive this. Errors: PinWriter::open.
    Result<void> open(const board::linux::PinsFile& file, int writer, const std::string& link,
                      const std::string& sysfs_root, SystemCalls& system);

    struct Cut {
        board::linux::ForcedOutputs outputs;  ///< pins as they were forced first; what was missing at the end
        Nanoseconds took{};                   ///< until all that could be forced at once was
        bool gone = false;                    ///< the process
    };
    [[nodiscard]] Cut cut(const Dying& sketch, board::linux::SketchDeath how);
    /// Returns when the process is gone, and the outputs have been forced once more after that.
    void outlast(const Dying& sketch, Cut& cut);

    void release_lines() { outputs_.release_lines(); }

  private:
    bool wait_until_gone(const Dying& sketch, int timeout_ms);

    const board::linux::PinsFile* file_ = nullptr;
    board::linux::SafeOutputs outputs_;
    std::string link_;
    SystemCalls* system_ = nullptr;
};

}  // namespace qduino::supervisor
