#include "apps/printer_sim/board_costs.h"

#include <algorithm>

#include "terminal/human.h"

namespace qduino::apps {
namespace {

using board::sim::ApiCall;
using board::sim::CoreTally;
using board::sim::SimConfig;
using board::sim::Tally;
using Json = nlohmann::ordered_json;

/// The loop that plays the steps has this core (sketches/printer).
constexpr int kStepperCore = 1;
/// What a step is made of, on its core: the first rows.
constexpr std::size_t kRowsOfAStep = 3;

std::string key_of(std::string what) {
    std::ranges::replace(what, ' ', '_');
    return what;
}

}  // namespace

BoardCosts board_costs(const std::string& name, const SimConfig& config, const board::sim::SimBoard& board,
                       double seconds, std::uint64_t steps) {
    BoardCosts costs{.name = name, .seconds = seconds, .steps = steps, .rows = {}, .busy = {}};
    for (int core = 0; core < board.core_count(); ++core) costs.busy.push_back(board.busy_time(core));
    const auto add = [&](const char* what, auto tally_of) {
        BoardCosts::Row& row = costs.rows.emplace_back();
        row.what = what;
        for (int core = 0; core < board.core_count(); ++core)
            row.cores.push_back(tally_of(board.tally(core)));
    };
    const auto add_call = [&](const char* what, ApiCall call) {
        add(what, [&](const CoreTally& core) {
            return Tally{core.of(call), config.costs[call] * static_cast<std::int64_t>(core.of(call))};
        });
    };
    const auto add_tally = [&](const char* what, Tally CoreTally::*tally) {
        add(what, [&](const CoreTally& core) { return core.*tally; });
    };
    add_call("pin writes", ApiCall::pin_write);
    add_call("pin reads", ApiCall::pin_read);
    add_call("clock readings", ApiCall::now);
    add_call("pwm writes", ApiCall::pwm_write);
    add_call("i2c transfers", ApiCall::i2c);
    add_call("sleeps", ApiCall::sleep);
    add_call("locks", ApiCall::lock);
    add_tally("bus bytes", &CoreTally::bus);
    add_tally("interrupts", &CoreTally::interrupts);
    add_tally("edges", &CoreTally::edges);
    add_tally("ticks", &CoreTally::ticks);
    add_tally("context switches", &CoreTally::switches);
    return costs;
}

double BoardCosts::ns_per_step(const Row& row) const {
    Nanoseconds sum{0};
    for (const Tally& core : row.cores) sum += core.time;
    return steps == 0 ? 0 : static_cast<double>(sum.count()) / static_cast<double>(steps);
}

double BoardCosts::ns_of_a_step(int core) const {
    const auto index = static_cast<std::size_t>(core);
    Nanoseconds sum{0};
    for (std::size_t i = 0; i < std::min(kRowsOfAStep, rows.size()); ++i) {
        if (index < rows[i].cores.size()) sum += rows[i].cores[index].time;
    }
    return steps == 0 ? 0 : static_cast<double>(sum.count()) / static_cast<double>(steps);
}

Json to_json(const BoardCosts& costs) {
    Json out;
    out["file"] = costs.name;
    out["seconds"] = costs.seconds;
    out["step_ns"] = costs.ns_of_a_step(kStepperCore);
    out["cores"] = Json::array();
    const std::size_t cores = costs.rows.empty() ? 0 : costs.rows[0].cores.size();
    for (std::size_t core = 0; core < cores; ++core) {
        Json rows;
        for (const BoardCosts::Row& row : costs.rows) {
            const Tally& tally = row.cores[core];
            const auto count = static_cast<double>(tally.count);
            rows[key_of(row.what)] = {
                {"count", tally.count},
                {"per_s", count / costs.seconds},
                {"per_step", costs.steps == 0 ? 0 : count / static_cast<double>(costs.steps)},
                {"share", to_seconds(tally.time) / costs.seconds}};
        }
        rows["busy_share"] = to_seconds(costs.busy[core]) / costs.seconds;
        out["cores"].push_back(std::move(rows));
    }
    return out;
}

std::string table(const BoardCosts& costs) {
    if (costs.rows.empty()) return {};
    const std::size_t cores = costs.rows[0].cores.size();
    std::string out = text<std::string>("Board ", costs.name, ": ", costs.steps, " steps in ",
                                        Fixed{costs.seconds, 1}, " s of virtual time\n", column("", -18));
    for (std::size_t core = 0; core < cores; ++core)
        write(out, column(text<std::string>("core ", core, ": a second"), 20), column("of it", 10));
    write(out, column("ns a step", 12), '\n');
    std::vector<double> taken(cores);
    for (const BoardCosts::Row& row : costs.rows) {
        if (std::ranges::all_of(row.cores, [](const Tally& t) { return t.count == 0; })) continue;
        write(out, "  ", column(row.what, -16));
        for (std::size_t core = 0; core < cores; ++core) {
            const double share = to_seconds(row.cores[core].time) / costs.seconds;
            taken[core] += share;
            write(out, column(Fixed{static_cast<double>(row.cores[core].count) / costs.seconds, 1}, 20),
                  column(Fixed{share * 100, 2}, 8), " %");
        }
        write(out, column(Fixed{costs.ns_per_step(row), 1}, 12), '\n');
    }
    write(out, "  ", column("in all", -16));
    for (const double share : taken) write(out, column("", 20), column(Fixed{share * 100, 2}, 8), " %");
    write(out, "\n  ", column("loops", -16));
    for (const Nanoseconds busy : costs.busy)
        write(out, column("", 20), column(Fixed{to_seconds(busy) / costs.seconds * 100, 2}, 8), " %");
    const double step_ns = costs.ns_of_a_step(kStepperCore);
    if (step_ns > 0)
        write(out, "\n  Pins and clock take ", Fixed{step_ns, 0}, " ns of core ", kStepperCore,
              " for each step; looks at the clock between steps are among it.");
    return out + '\n';
}

}  // namespace qduino::apps
