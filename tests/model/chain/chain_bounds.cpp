// The bounds of admission on chains, for chain_model.py: a set for each line of standard input, an
// answer for each line of standard output. One unit of time is a millisecond.
//
//   LOOPS STAGES QUEUED, as in "1/5@0 2/10@0" "1 2" "0 1" with ';' between them:
//     1/5@0 2/10@0; 1 2; 0 1     loop 1 has 1 of 5 ms on core 0; a ring is before the second stage
//     ─► "reaction age" in nanoseconds, or "refused"
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "runtime/plan.h"

namespace {

using namespace qduino;

void nothing() {}

bool read_loops(const std::string& words, runtime::SketchTable& table) {
    std::istringstream in(words);
    int budget = 0, period = 0, core = 0;
    char slash = 0, at = 0;
    while (in >> budget >> slash >> period >> at >> core) {
        const auto id = static_cast<board::VcpuId>(table.loops.size() + 1);
        table.loops.push_back({{id, budget * Nanoseconds{1ms}, period * Nanoseconds{1ms}, core}, &nothing});
    }
    return !table.loops.empty();
}

/// With the releases from one origin, as they are; or wherever they like.
std::string answer(const std::string& line) {
    std::istringstream in(line);
    std::string loops, stages, queued;
    std::getline(in, loops, ';');
    std::getline(in, stages, ';');
    std::getline(in, queued, ';');
    runtime::SketchTable table;
    if (!read_loops(loops, table)) return "no loops";
    runtime::Chain chain;
    chain.name = "chain";
    chain.source = runtime::Chain::Source::read;
    chain.from = chain.to = "pin 1";
    std::istringstream ids(stages), rings(queued);
    for (int id = 0, ring = 0; ids >> id && rings >> ring;)
        chain.stages.push_back({static_cast<board::VcpuId>(id), {}, ring != 0});
    runtime::Plan plan(true);
    if (!plan.add_loops(table)) return "wrong";
    plan.add_chain(chain);
    if (!plan.admit(std::vector<sched::PlatformOverheads>(2))) return "refused";
    const sched::ChainBound& bound = plan.chains().front().bound;
    return text<std::string>(bound.reaction.count(), ' ', bound.age.count());
}

}  // namespace

int main() {
    for (std::string line; std::getline(std::cin, line);) std::cout << answer(line) << '\n';
    return 0;
}
