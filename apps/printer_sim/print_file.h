// Prints one file in virtual time, from its first byte to a report on what was built.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/printer_sim/board_costs.h"
#include "apps/printer_sim/observed.h"
#include "base/result.h"
#include "board/sim/config.h"
#include "printer/estimate/estimator.h"
#include "printer/link/layout.h"
#include "printer/machine_config.h"
#include "twin/fault.h"
#include "twin/report.h"

namespace qduino::apps {

/// Why a job is not even begun: what preflight found first.
struct Refusal {
    std::uint64_t line = 0;  ///< 0: the file as a whole
    std::string text;        ///< the line as it stands
    std::string why;
    std::string cure;
};

struct PrintResult {
    std::optional<Refusal> refusal;  ///< nothing was heated or moved; what follows is empty
    /// What preflight would have people look at, each once, with its line.
    std::vector<std::string> remarks;
    bool job_completed = false;            ///< by the sketch's own word
    std::string error;                     ///< why not
    double print_time_s = 0;               ///< virtual, from the job's beginning to its end
    printer::estimate::Estimate estimate;  ///< made before the print
    double wall_s = 0;
    twin::Report built;
    printer::link::MotionStatus motion;
    std::vector<std::string> unknown_codes;
    std::vector<std::string> warnings;
    std::vector<std::string> answers;  ///< to the job's questions and experiments (M306 T)
    printer::link::KeptHeat kept{};    ///< of M500
    printer::KeptBeds kept_beds{};     ///< … and the beds
    std::optional<Observed> observed;  ///< when it was asked for
    std::optional<BoardCosts> board;   ///< of a board file
    std::string chains;                ///< what was seen of the sketch's chains, in lines

    /// The built part is the one that was asked for, and the job ran to its end.
    [[nodiscard]] bool success() const { return job_completed && built.matches; }
};

/// Keys as docs/printer-sim.md lists them.
nlohmann::ordered_json to_json(const PrintResult& result);

/// A few lines for a person, at most 80 columns wide.
std::string summary(const PrintResult& result);

struct PrintOptions {
    std::string file;
    /// Printed first, one after another, by the same printer: nothing of them may be left when
    /// `file` begins. The result is `file`'s alone, and so are the steps.
    std::vector<std::string> before;
    printer::MachineConfig machine;
    twin::Machine metal;     ///< what the twin is
    std::string steps_path;  ///< CSV of every step; empty: none
    std::vector<twin::Fault> faults;
    /// A job that brings no homing or no heating is given both (printer/preflight/prologue.h).
    bool prologue = false;
    bool heights = false;  ///< watch them: PrintResult::observed
    bool cells = false;    ///< and keep them for a picture
    board::sim::SimConfig computer;
    std::string board_name;  ///< of its file; empty: its costs are not reported
    /// Called now and then with the fraction of the file executed and the virtual time in seconds.
    /// May be empty.
    std::function<void(double, double)> progress;
};

/// A job that preflight refuses is not printed, as the print service would not. Error: the file
/// cannot be read or is no G-code, the step file cannot be written, the sketch is refused. Once per
/// process.
Result<PrintResult> print_file(const PrintOptions& options);

}  // namespace qduino::apps
