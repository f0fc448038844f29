// A sketch and the reports about it share a terminal. The sketch's words go to standard output,
// reports to standard error, and neither is torn apart.
//
//   blinks: 1                        the sketch
//   blinks: 3
//                                    an empty line
//   loop   passes  releases …        the report
#pragma once

#include <string>

namespace qduino::apps {

/// Writes out what the sketch has written so far (Serial, stdout). Call it when no loop runs.
void settle_sketch_output();
/// True: the sketch's output to Serial waits (64 KB of it), so that a report can come first. False:
/// it goes on.
void hold_sketch_output(bool held);
/// Writes `text` in one piece, with an empty line between it and the sketch's output.
void report_beside_sketch(const std::string& text);

}  // namespace qduino::apps
