// The facts about a job once it has been read: the slicer's claims, what its moves really do, and
// what is wrong with it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "base/fixed_string.h"
#include "base/fixed_vector.h"
#include "printer/gcode/content.h"
#include "printer/gcode/position.h"
#include "printer/preflight/metadata.h"
#include "printer/preflight/thumbnail.h"

namespace qduino::printer::preflight {

/// The number of findings kept of each severity; further ones are counted.
inline constexpr std::size_t kFindingsMax = 16;

/// One thing that is wrong with a job.
struct Finding {
    std::uint64_t line = 0;  ///< 0: the file as a whole
    std::uint64_t offset = 0;
    FixedString<80> text;      ///< the line as it stands, printable, perhaps cut
    FixedString<236> message;  ///< what is wrong, and which limit it breaks
    FixedString<120> advice;   ///< what to do about it
};

/// The box around the ends of moves, X, Y, Z.
struct Bounds {
    std::array<Millimetres, 3> minimum{};
    std::array<Millimetres, 3> maximum{};
    bool empty = true;

    void include(const gcode::Position& position);
};

struct Facts {
    gcode::Content content = gcode::Content::empty;
    Metadata metadata;
    Thumbnail thumbnail;

    std::uint64_t bytes = 0;
    std::uint64_t lines = 0;
    std::uint64_t commands = 0;
    std::uint64_t moves = 0;  ///< chords of arcs count singly
    Millimetres filament;     ///< pushed by the moves, retractions taken off
    Bounds extruding_bounds;  ///< both ends of all moves that extrude
    Bounds bounds;            ///< of all moves
    Celsius hot_end_maximum;  ///< asked; 0: never heated
    Celsius bed_maximum;
    std::uint32_t layers = 0;  ///< with an extrusion in them
    Millimetres first_layer_height;
    Millimetres layer_height;  ///< mean of the layers above the first; 0 when there are none
    /// The largest of any axis, at the asked speed within the machine's limits.
    double step_rate_maximum_hz = 0;

    std::uint32_t unknown_codes = 0;
    std::uint32_t codes_not_done = 0;
    std::uint64_t errors_count = 0;
    std::uint64_t warnings_count = 0;
    FixedVector<Finding, kFindingsMax> errors;    ///< the first ones
    FixedVector<Finding, kFindingsMax> warnings;  ///< the first ones; each message once

    /// So many of the errors say that the job brings no homing, or no heating.
    std::uint64_t start_errors = 0;
    /// True when a prologue (prologue.h) is all that is missing.
    [[nodiscard]] bool lacks_start() const { return errors_count > 0 && errors_count == start_errors; }

    /// Where in `errors` the first one stands that no prologue mends.
    std::optional<std::size_t> unmendable{};
    /// What a person is told: what a prologue leaves, or else what it would mend. Contract: there
    /// is an error.
    [[nodiscard]] const Finding& first_error() const { return errors[unmendable.value_or(0)]; }

    /// True when this job may be printed on this machine.
    [[nodiscard]] bool accepted() const { return errors_count == 0; }
};

}  // namespace qduino::printer::preflight
