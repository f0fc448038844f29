// What a run took of each simulated core, by what took it: calls of the seam, interrupts, ticks and
// switches. With the costs of a board file, two computers can be compared on the same sketch.
//
// Counting is one increment for each call; it takes no virtual time.
#pragma once

#include <array>
#include <cstdint>

#include "base/time.h"
#include "board/sim/config.h"

namespace qduino::board::sim {

/// How often, and the time of the core that it took.
struct Tally {
    std::uint64_t count = 0;
    Nanoseconds time{};

    constexpr void add(Nanoseconds cost) {
        ++count;
        time += cost;
    }
};

struct CoreTally {
    /// Calls of the loops and handlers of this core. (Time: the count times SimConfig's cost of a
    /// call.)
    std::array<std::uint64_t, kApiCallCount> calls{};
    Tally bus;         ///< bytes of buses, Serial and sockets, at what the config says
    Tally interrupts;  ///< of devices; bottom halves that no I/O VCPU serves are part of them
    Tally edges;       ///< top halves of watched pins
    Tally ticks;
    Tally switches;

    [[nodiscard]] std::uint64_t of(ApiCall call) const { return calls[static_cast<std::size_t>(call)]; }
    void note(ApiCall call) { ++calls[static_cast<std::size_t>(call)]; }
};

}  // namespace qduino::board::sim
