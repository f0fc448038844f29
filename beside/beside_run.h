// One run of an image on a core that Linux gives up for it.
//
//   checks ─► memory: facts, pins, image, tables, trampoline ─► the core is given up ─► heartbeat,
//   start ─► Serial, reports, pins, both heartbeats … ─► its end ─► the core is taken back
//
// Whatever fails on this way, the core comes back: GivenCore's destructor sees to it. If this
// process is killed, the board misses the heartbeat; Linux stops the core when somebody writes 1 to
// its file `online`, or with the next run.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/result.h"
#include "base/time.h"
#include "board/peripherals.h"

namespace qduino::apps::beside_linux {

struct BesideOptions {
    int core = 1;               ///< Linux's number
    Nanoseconds silence = 5ms;  ///< after which the board drives its safe levels; 0: it runs on
    std::string words;          ///< the image's command line
    std::string link;           ///< file for a print service (link_relay.h); empty: none
};

/// Runs `image` to its end, or until Ctrl-C. Serial is on this terminal, reports are on standard
/// error. `wired` is what its pins lead to; unless another program serves them (`virtual-machine`).
/// Returns the image's status: 0, 1 on failure, 2 refused, 3 when it ended by Linux's silence.
/// Error: what this computer lacks, and what to do; the board did not start, or stood still.
[[nodiscard]] Result<int> run_beside(std::span<const std::uint8_t> image, const BesideOptions& options,
                                     board::Peripherals& wired);

}  // namespace qduino::apps::beside_linux
