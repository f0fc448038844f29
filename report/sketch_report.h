// Reports about a sketch on a terminal: why it was admitted or refused, and how its loops kept
// their periods.
#pragma once

#include <string>
#include <vector>

#include "runtime/runtime.h"

namespace qduino::apps {

/// One line for each loop: passes of its body, releases, overruns, dropped, worst lateness, release
/// latency (median, 99.9 %, worst). Call it when the loops have ended, or between two runs of a
/// simulator.
std::string loop_table(const std::vector<const runtime::Loop*>& loops);

/// A line for each loop that slept longer within a release than it declares, where that does not
/// fit; or nothing.
std::string sleep_notes(const runtime::Runtime& runtime);

/// The same in a few words, to follow those of periods_kept(): "; undeclared sleep: loop 2"; or
/// nothing.
std::string sleep_verdict(const runtime::Runtime& runtime);

/// A few words: "every period was kept (2 loops, 1200 releases)", or how many releases overran and
/// which loop has not ended its last one. At `now` every loop has been told to end.
std::string periods_kept(const std::vector<const runtime::Loop*>& loops, Instant now);

/// "loop 2 never ran, loop 3 has not ended": of those that were told to end and have not.
std::string loops_left(const std::vector<const runtime::Loop*>& loops);

/// How a run went, to be said at its end: loop_table(), a line "Periods: …" of the two above and of
/// chain_verdict(), and chain_lines().
std::string run_report(const runtime::Runtime& runtime, Instant now);

/// What its board guarantees, with what admission promises of the bottom halves that have run and
/// of the chains, and how loops and chains have kept that so far. On the host's thread, also while
/// the loops run.
board::GuaranteeReport guarantee_of(runtime::Runtime& runtime);

/// The loops of a runtime, in order of id.
std::vector<const runtime::Loop*> loops_of(const runtime::Runtime& runtime);

}  // namespace qduino::apps
