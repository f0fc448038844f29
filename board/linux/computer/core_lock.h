// One owner for each core of a computer.
//
// Two loops that own one core would starve each other: both spin at the highest priority. So a
// sketch that is about to own core N takes a lock on a file. A second sketch of the same user, or
// one of another user where root has the core, is refused before its loops start.
//
//   /run/qduino/qduino-core1.lock   root's; shared_file.h says where other users' lie
//     pid 4711
//     since 2026-03-01 11:31:34 UTC
//     program printer
//     command printer --pins /dev/shm/…
//
// The lock belongs to the open file: it ends with its holder, however that dies. The
// lock alone decides which sketch has the core; the words in the file are for people. The lock is
// advisory: other real-time programs do not know it. One that spins on the core is found by looking
// (core_rivals.h) and named: a loop would stand behind it for ever. A holder that was killed may
// stand behind such a task, too, and cannot end; then that task is to blame.
#pragma once

#include <string>

#include "base/result.h"
#include "base/time.h"
#include "board/linux/kernel/shared_file.h"

namespace qduino::board::linux {

/// Gives the core back when it goes.
class CoreLock {
  public:
    CoreLock() = default;  ///< holds nothing

    /// Takes core `core`. Waits at most `patience` for a holder that is just dying, since a
    /// supervisor starts its sketch anew quickly. `root` precedes the folders (tests). Setup-time.
    /// Errors: unavailable (another process has it, or spins on it: the text names it and says what
    /// to do); not_permitted (no folder takes the file: nothing is held, and nobody is kept out).
    static Result<CoreLock> take(int core, Nanoseconds patience, const std::string& root = "");

    [[nodiscard]] bool held() const { return file_.held(); }
    [[nodiscard]] const std::string& path() const { return file_.path(); }

  private:
    void write_holder() const;

    HeldFile file_;
};

}  // namespace qduino::board::linux
