// The heat watch: a second, tiny process that cuts the heat when the supervisor itself cannot.
//
//   supervisor ──fork, before the sketch──► heat watch
//        │ beats: a counter in a page that both share   looks every 20 ms; nothing wakes it between
//        │ the sketch's number                          two looks
//        └──fork, exec──► sketch
//
// It acts when
// - the supervisor is dead (its pidfd),
// - or has not beaten for 50 looks (1 s) while a sketch runs,
// - or has left a dead sketch alone for 3 looks.
//
// Then it kills the sketch, forces every output (safe_hands.h), and marks the link. A silent
// supervisor loses its priority. Last, the computer's settings are put back.
//
// It counts its own looks and not time: a virtual machine that was stopped for a second is no
// silent supervisor. It cannot spin, because it sleeps before every look, whatever the calls
// answer. It also has the supervisor's budget (importance.h).
//
// For each death, who acts and how long the heaters stay on (S supervisor, K sketch, W heat watch;
// "frozen": stopped, or spinning in the kernel):
//
//   dies or freezes     who acts                                       the heaters are on for
//   ───────────────────────────────────────────────────────────────────────────────────────────
//   K dies              S sees its witness die (10 ms), forces         ≤ 10 ms and S's wake-up
//   K hangs             S misses a promise, kills K, forces            the promise, and 10 ms
//   S dies              W sees it (20 ms), kills K, forces, ends       ≤ 20 ms and W's wake-up
//   S frozen            W misses 50 beats, kills K, forces; takes      as K's own heat loop says;
//                       S's priority                                   then cut: 1 s
//   W dies              S starts another, K goes on                    as K's heat loop says
//   K dies, S dies      W, as for S                                    ≤ 20 ms
//   K dies, S frozen    W finds K dead at 3 looks and nobody acting    ≤ 80 ms
//   K dies, W dies      S, as for K                                    ≤ 10 ms
//   K hangs, S dies     W, as for S                                    ≤ 20 ms
//   K hangs, S frozen   W, as for S frozen                             1 s
//   S dies, W dies      K gets SIGTERM (PR_SET_PDEATHSIG), stops in    its longest period; 3 s when
//                       order                                          a loop hangs
//   S frozen, W dies    nobody has to: K goes on                       as K's heat loop says
//   all three           nobody                                         until the next start: this
//                                                                      is for a thermal fuse
//
// A clean end of the supervisor ends its watch without a word. After the supervisor's death, the
// watch ends once the sketch is gone: at ordinary priority, reaped by init.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <string>

#include "apps/supervisor/safe_hands.h"
#include "base/result.h"
#include "board/linux/pin/pins_file.h"
#include "posix/mapping.h"
#include "posix/unique_fd.h"

namespace qduino::supervisor {

/// Shared by the two processes. Zeroes are its first state.
struct HeatWatchPage {
    std::atomic<std::uint64_t> beats;
    /// The sketch's number; 0: none, or everything that its death asked for is done.
    std::atomic<std::int32_t> sketch;
    std::atomic<std::uint32_t> beating;  ///< 1: beats are to be expected
    std::atomic<std::int32_t> cut;       ///< the sketch that the watch has cut the heat of
};

struct HeatWatchTask {
    const board::linux::PinsFile* file = nullptr;  ///< outlives the watch
    std::string link;                              ///< empty: none
    std::string settings_state;
    std::string sysfs_root;
    bool real_time = false;
};

/// The supervisor's handle of the watch.
class HeatWatch {
  public:
    /// Starts it. At ordinary priority; the caller has one thread. Errors: the system's.
    Result<void> start(const HeatWatchTask& task);

    // ---- real-time safe -------------------------------------------------------------------------
    void expect_beats(bool expected) {
        if (page_) page_->beating = expected ? 1 : 0;
    }
    void beat() {
        if (page_) page_->beats.fetch_add(1, std::memory_order_relaxed);
    }
    void sketch_is(pid_t sketch) {  ///< 0: none any more
        if (page_) page_->sketch = sketch;
    }
    /// True when the watch has ended this sketch.
    [[nodiscard]] bool has_cut(pid_t sketch) const { return page_ && page_->cut == sketch; }
    /// Readable once the watch is dead; −1: there is none.
    [[nodiscard]] int descriptor() const { return pidfd_.get(); }

    /// Ends the watch, or reaps it. At ordinary priority.
    void end();

  private:
    posix::Mapping memory_;
    HeatWatchPage* page_ = nullptr;
    posix::UniqueFd pidfd_;
    pid_t pid_ = -1;
    SafeHands hands_;  // used by the child alone; open here, where an error can be told
    SystemCalls system_;
};

}  // namespace qduino::supervisor
