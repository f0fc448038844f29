// What a sketch declares, collected before main(): its loops.
//
// Each `loop(id, budget, period, core) { … }` registers one LoopDeclaration through a static
// object; the runtime reads the table once, admits it, and hands VcpuSpecs to the board. The table
// is bounded and in static storage.
#pragma once

#include <cstdint>

#include "base/fixed_vector.h"
#include "base/time.h"
#include "board/types.h"

namespace qduino::runtime {

using sched::kAnyCore;

/// What happens when a release of a loop ends after the next one should have begun.
enum class OverrunPolicy : std::uint8_t {
    /// Drop the releases that were missed; go on at the next nominal one (default; keeps phase).
    skip,
    catch_up,    ///< run the missed releases back to back until on time again
    keep_phase,  ///< as skip, but the release that is late is itself not counted as one
    call_back,   ///< call the loop's handler with the lateness, then as skip
    stop,        ///< stop the sketch, through its safe states
};

using board::DeviceClass;

struct LoopDeclaration : sched::Vcpu {
    void (*body)() = nullptr;
    const char* file = "";  ///< where it is declared, for refusals
    int line = 0;
    bool classic = false;  ///< Arduino's own loop(), without a budget of its author's
    /// The author says in how many pieces a release sleeps. Else it counts as one, and admission
    /// refuses where the number matters.
    bool says_sleeps = false;
};

/// The declared loops, in order of declaration. `dropped` counts those past the 32nd.
struct SketchTable {
    FixedVector<LoopDeclaration, board::kMaxLoop> loops;
    int dropped = 0;
    void (*setup)() = nullptr;
};

/// The one table of this program.
SketchTable& sketch_table();

}  // namespace qduino::runtime
