// The service's view of the sketch: the link's status slots, read once per tick and checked field
// by field.
//
// The sketch is another process, possibly of another build, possibly dying: a byte that is no valid
// bool or enumerator must not become undefined behaviour here. FixedString cuts its own text at its
// capacity. Numbers need no check beyond those that their users make.
#pragma once

#include <cstdint>
#include <string>

#include "printer/link/layout.h"

namespace qduino::spool {

enum class SketchLife : std::uint8_t { alive = 0, died = 1, hung = 2 };

/// A snapshot that is consistent enough: each slot is whole, and the three are of about the same
/// instant.
struct MachineView {
    bool connected = false;  ///< false: nothing below means anything
    std::uint64_t session = 0;
    SketchLife life = SketchLife::alive;
    std::string death_note;  ///< why it is dead, in its supervisor's words; empty: not said
    /// It is dead, and the note may still come (set by the caller, who watches it over time).
    bool may_be_explained = false;
    /// False: the heartbeat stands still (set by the caller, who watches it over time).
    bool responding = true;
    double time_factor = 1;  ///< the printer's seconds in one of the wall's; above 0, finite
    printer::link::JobStatus job;
    printer::link::MotionStatus motion;
    printer::link::HeatStatus heat;
};

/// A four-slot has one reader: one thread of this process may call this. `layout` is not null.
[[nodiscard]] MachineView read_machine(const printer::link::LinkLayout& layout);

/// The same checks on values that are already copied; for tests.
[[nodiscard]] printer::link::JobStatus checked(const printer::link::JobStatus& raw);
[[nodiscard]] printer::link::MotionStatus checked(const printer::link::MotionStatus& raw);
[[nodiscard]] printer::link::HeatStatus checked(const printer::link::HeatStatus& raw);

}  // namespace qduino::spool
