// What the sketch took of a simulated computer, for comparing computers: calls of pins and clock,
// interrupts, ticks and switches of each core, a second and a step, with the costs of a board file.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "board/sim/config.h"
#include "board/sim/sim_board.h"

namespace qduino::apps {

struct BoardCosts {
    std::string name;  ///< the board file
    double seconds = 0;
    std::uint64_t steps = 0;
    struct Row {
        std::string what;
        std::vector<board::sim::Tally> cores;
    };
    std::vector<Row> rows;  ///< all with as many cores
    /// CPU time of the loops and bottom halves of each core. A loop that owns its core has it all.
    std::vector<Nanoseconds> busy;

    [[nodiscard]] double ns_per_step(const Row& row) const;
    /// The time that calls of pins and the clock take of the stepper loop's core (`core`), for each
    /// step.
    [[nodiscard]] double ns_of_a_step(int core) const;
};

/// The costs of a run of `board`, on which the motors made `steps` steps.
[[nodiscard]] BoardCosts board_costs(const std::string& name, const board::sim::SimConfig& config,
                                     const board::sim::SimBoard& board, double seconds, std::uint64_t steps);

/// {"file", "cores": [{"pin_writes": {"count", "per_s", "per_step", "share"}, …}], "step_ns"}
[[nodiscard]] nlohmann::ordered_json to_json(const BoardCosts& costs);
/// For people: a row for what there was, a column for each core.
[[nodiscard]] std::string table(const BoardCosts& costs);

}  // namespace qduino::apps
