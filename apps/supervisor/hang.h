// Finds the hang of a sketch in the promises of its loops (board/linux/signs_of_life.h), and puts
// it into words.
//
//   silent  a loop is not heard of although it said so: a spin without end, a lock, a SIGSTOP
//   stuck   a loop, a handler or setup() is heard of and does not get on: a poll, a long delay()
//
// and in the beat of its warden (board/linux/warden.h), without which no budget is kept: whatever a
// loop promises, the others cannot rely on it any more.
//
//   unwatched   the warden is dead, or its last look is too old, whoever lives under its number
#pragma once

#include <string>

#include "base/time.h"
#include "board/window/pins_layout.h"

namespace qduino::supervisor {

struct Hang {
    enum class Kind { none, silent, stuck, unwatched };
    Kind kind = Kind::none;
    board::VcpuId vcpu = board::kNoVcpu;  ///< kNoVcpu of a stuck one: setup()
    Nanoseconds overdue{};                ///< the promise, or the warden's look
    // Of a stuck one:
    Nanoseconds limit{};  ///< from progress to progress, as promised
    Instant heard_of;     ///< the last sign of life, or the end of the sleep that it announced

    bool dead = false;  ///< of a warden: its process is

    [[nodiscard]] bool found() const { return kind != Kind::none; }
};

/// The first hang at `now`, silent ones first, a warden last. `bound`: what the supervisor waits
/// beyond what a loop announced.
[[nodiscard]] Hang find_hang(const board::PinsLayout& layout, Instant now, Nanoseconds bound);

/// "loop 1 hung (…)", with what it does instead of getting on; or without, where its core was taken
/// from it, and it did nothing.
[[nodiscard]] std::string hang_text(const Hang& hang, Instant now, bool core_was_taken = false);

}  // namespace qduino::supervisor
