// What the service believes of the sketch: the link's status slots, read once per tick and checked field by field.
//
// The sketch is another process, possibly of another build, possibly dying: a byte that is no valid bool or
// enumerator must not become undefined behaviour here. Text is cut at its capacity by FixedString itself; numbers need no check
// beyond what their users do with them.
#pragma once

#include <cstdint>
#include <string>

#include "printer/link/layout.h"

namespace qduino::spool {

enum class SketchLife : std::uint8_t { alive = 0, died = 1, hung = 2 };

/// One consistent-enough snapshot: each slot is whole, the three are of about the same instant.
struct MachineView {
    bool connected = false;  ///< false: nothing below means anything
    std::uint64_t session = 0;
    SketchLife life = SketchLife::alive;
    std::string death_note;  ///< why it is dead, in its supervisor's words; empty: not said
    bool may_be_explained =
        false;               ///< it is dead, and the note may still come (set by who watches it over time)
    bool responding = true;  ///< false: the heartbeat stands still (set by who watches it over time)
    double time_factor = 1;  ///< the printer's seconds in one of the wall's; above 0, finite
    printer::link::JobStatus job;
    printer::link::MotionStatus motion;
    printer::link::HeatStatus heat;
};

/// The only reader of the four-slots in this process may call this: one thread. `layout` is not null.
[[nodiscard]] MachineView read_machine(const printer::link::LinkLayout& layout);

/// Same checks on values that are already copied; for tests.
[[nodiscard]] printer::link::JobStatus checked(const printer::link::JobStatus& raw);
[[nodiscard]] printer::link::MotionStatus checked(const printer::link::MotionStatus& raw);
[[nodiscard]] printer::link::HeatStatus checked(const printer::link::HeatStatus& raw);

}  // namespace qduino::spool
