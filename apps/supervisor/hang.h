// Finds the hang of a sketch in the promises of its loops (board/linux/pin/signs_of_life.h), and
// puts it into words.
//
//   silent  a loop is not heard of although it said so: a spin without end, a lock, a SIGSTOP
//   stuck   a loop, a handler or setup() is heard of and does not get on: a poll, a long delay()
//
// and in the beat of its warden (board/linux/loop/warden.h), without which no budget is kept:
// whatever a loop promises, the others cannot rely on it any more.
//
//   unwatched   the warden is dead, or its last look is too old, whoever lives under its number
//
// A job that is stopped as a whole (Ctrl-Z, a freezer) has nobody who hangs, but the supervisor may
// be the first to go on, and then every promise is old. So what was promised before a pause of the
// supervisor holds for as much longer as the pause took (Pauses).
#pragma once

#include <array>
#include <string>

#include "base/time.h"
#include "board/window/pins_layout.h"

namespace qduino::supervisor {

struct Hang {
    enum class Kind { none, silent, stuck, unwatched };
    Kind kind = Kind::none;
    board::VcpuId vcpu = board::kNoVcpu;  ///< kNoVcpu of a stuck one: setup()
    Nanoseconds overdue{};                ///< the promise, or the warden's look
    // Set for a stuck one only:
    Nanoseconds limit{};  ///< from progress to progress, as promised
    Instant heard_of;     ///< the last sign of life, or the end of the sleep that it announced

    bool dead = false;  ///< of a warden: its process is

    [[nodiscard]] bool found() const { return kind != Kind::none; }
};

/// How much longer the promises hold that a pause of this very process has delayed. One that its
/// loop makes anew after the pause holds as it says. Several pauses add up: a loop that hangs is
/// found after the time that this process itself was there to watch.
class Pauses {
  public:
    /// Between two looks lie at most some 10 ms, unless this process was stopped, or starved.
    static constexpr Nanoseconds kLongestTurn = 100ms;

    /// Call before each look, with what has passed since the last one.
    void turn_took(const board::PinsLayout& layout, Nanoseconds turn);

    [[nodiscard]] Instant end_of_beat(const board::PinsLayout& layout, board::VcpuId vcpu) const;
    [[nodiscard]] Instant end_of_progress(const board::PinsLayout& layout, board::VcpuId vcpu) const;
    [[nodiscard]] Instant end_of_wardens_look(const board::PinsLayout& layout) const;

  private:
    struct Promise {
        std::int64_t by_ns = 0;
        Nanoseconds longer{};

        void delay(std::int64_t now_by_ns, Nanoseconds turn);
        [[nodiscard]] Instant end(std::int64_t now_by_ns) const;
    };
    std::array<Promise, board::kVcpuLimit> beats_, progress_;
    Promise warden_;
};

/// The first hang at `now`, silent ones first, a warden last. `bound`: what the supervisor waits
/// beyond what a loop announced.
[[nodiscard]] Hang find_hang(const board::PinsLayout& layout, Instant now, Nanoseconds bound,
                             const Pauses& pauses = {});

/// "loop 1 hung (…)", with what it does instead of getting on; or without, where its core was taken
/// from it, and it did nothing.
[[nodiscard]] std::string hang_text(const Hang& hang, Instant now, bool core_was_taken = false);

}  // namespace qduino::supervisor
