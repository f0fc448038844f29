// What is said about a sketch on a terminal: why it was admitted or refused, and how its loops kept their periods.
#pragma once

#include <string>
#include <vector>

#include "runtime/runtime.h"

namespace qduino::apps {

/// One line for each loop: passes of its body, releases, overruns, dropped, worst lateness, release latency (median, 99.9 %, worst). The loops
/// have ended, or are those of a simulator between two runs.
std::string loop_table(const std::vector<const runtime::Loop*>& loops);

/// In a few words: "every period was kept (2 loops, 1200 releases)", or how many overran.
std::string periods_kept(const std::vector<const runtime::Loop*>& loops);

/// The loops of a runtime, in order of id.
std::vector<const runtime::Loop*> loops_of(const runtime::Runtime& runtime);

}  // namespace qduino::apps
