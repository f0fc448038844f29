// A sketch's own words and what is said about it share a terminal: the sketch's go to standard output, reports to standard error, and
// neither is torn apart.
//
//   blinks: 1                        the sketch
//   blinks: 3
//                                    an empty line
//   loop   passes  releases …        the report
#pragma once

#include <string>

namespace qduino::apps {

/// Lets out what the sketch has written so far (Serial, stdout). When no loop runs.
void settle_sketch_output();
/// True: what the sketch writes to Serial waits (64 KB of it), so that something can be said first; false: it goes on.
void hold_sketch_output(bool held);
/// Says `text` in one piece, set off from what the sketch wrote by an empty line.
void report_beside_sketch(const std::string& text);

}  // namespace qduino::apps
