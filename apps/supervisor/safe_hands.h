// Makes the machine of a dead or condemned sketch safe, before anything else.
//
//   cut()      at real-time priority forces every output; marks the pins file and the link as dead;
//                                    forces again while the process comes apart, until it is gone
//                                    (its GPIO lines are free only then): 100 ms at most; lets its
//                                    threads die (dying_threads.h)
//   outlast()  at ordinary priority  for a process that does not go: kills it, lets its threads die
//                                    and forces again, every 100 ms, until it has gone
//
// The supervisor has a pair of these hands, and its heat watch has another, with a ring of its own.
#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>

#include "apps/supervisor/system_calls.h"
#include "base/result.h"
#include "base/time.h"
#include "board/linux/pin/safe_outputs.h"

namespace qduino::supervisor {

/// A process that is dying: its pidfd, and its number for messages and for the link.
struct Dying {
    int pidfd = -1;
    pid_t pid = 0;
};

/// Writes into the link at `path` how `sketch` died, for the print service, once: the first writer
/// wins. Does nothing when there is no such link, or when it belongs to another living sketch. At
/// ordinary priority, after SafeHands::cut().
void write_death_note(const std::string& path, pid_t sketch, std::string_view note);

class SafeHands {
  public:
    /// `link` may be empty. `file` must outlive this. Errors: PinWriter::open.
    Result<void> open(const board::linux::PinsFile& file, int writer, const std::string& link,
                      const std::string& sysfs_root, SystemCalls& system);

    struct Cut {
        /// Pins as they were forced first, and what was missing at the end.
        board::linux::ForcedOutputs outputs;
        Nanoseconds took{};  ///< until all that could be forced at once was
        bool gone = false;   ///< the process
    };
    [[nodiscard]] Cut cut(const Dying& sketch, board::SketchDeath how);
    /// Returns when the process is gone and the outputs have been forced once more after that.
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
