// The main() of a sketch that has no program of its own: the same course on every board.
//
//   options ─► board file ─► admission, setup() ─► report ─► run ─► report ─► exit status
//
// A sketch and the reports about it share a terminal. The sketch's words go to standard output,
// reports to standard error, and neither is torn apart.
//
//   blinks: 1                        the sketch
//   blinks: 3
//                                    an empty line
//   loop   passes  releases …        the report
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "runtime/runtime.h"
#include "terminal/command_line.h"

namespace qduino::apps {

/// What every board's main() is asked for.
struct SketchOptions {
    double length_s = 0;
    std::string board_path;   ///< board file; empty: the default board
    std::string report_path;  ///< where the guarantees go; empty: nowhere
    /// Measure execution times, and write them here, as JSON; empty: do not.
    std::string profile_path;
    double margin_percent = 20;  ///< of the suggestions, above the worst observed
    std::string name;            ///< of the sketch, for a profile

    [[nodiscard]] bool profiles() const { return !profile_path.empty(); }
};
/// Adds --for, which it returns, --board, --report, --profile and --margin.
CommandLine::Option add_sketch_options(CommandLine& line, SketchOptions& options, const char* length,
                                       const char* board);

/// What differs between the boards.
struct SketchCourse {
    std::string refused;  ///< said last when admission refuses the sketch
    runtime::RuntimeOptions runtime{};
    /// Calls setup(); false: it was left before its end, and no loop is to run. Empty: it is
    /// called.
    std::function<bool(void (*setup)())> setup;
    std::function<std::string()> opening;         ///< behind the table of admission
    std::function<void(runtime::Runtime&)> play;  ///< runs the loops …
    std::function<void(runtime::Runtime&)> stop;  ///< … and ends them
    /// Reports on the loops when they have ended; returns the exit status.
    std::function<int(const std::vector<const runtime::Loop*>&)> report;
    /// Last: where loops have not ended, the process does, and this does not return. What they use
    /// would be destroyed under them. Empty: they always have.
    std::function<void(int status)> leave;
};
/// Returns the exit status: 0, 1 on failure, 2 when admission refuses the sketch.
int run_sketch(board::Board& board, const SketchOptions& options, const SketchCourse& course);

/// True when the calls that declare I/O VCPUs (attachInterrupt(), interruptsVcpu() …) are linked
/// into this program: its setup() may then make some. False: setup() cannot add to what admission
/// knows. (Loops declare themselves before main().)
[[nodiscard]] bool setup_may_declare();
/// Writes out what the sketch has written so far (Serial, stdout). Call it when no loop runs.
void settle_sketch_output();
/// Writes `report` in one piece, with an empty line between it and the sketch's output.
void report_beside_sketch(const std::string& report);

}  // namespace qduino::apps
