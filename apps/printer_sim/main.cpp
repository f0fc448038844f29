// printer-sim: prints a G-code file in virtual time and reports whether the built part is the one
// that was asked for.
#include <unistd.h>

#include <cstdio>
#include <filesystem>

#include "apps/printer_sim/part_picture.h"
#include "apps/printer_sim/print_file.h"
#include "apps/printer_sim/sim_printer.h"
#include "config/board_file.h"
#include "config/machine_file.h"
#include "config/twin_machine.h"
#include "posix/durable_file.h"
#include "posix/small_file.h"
#include "report/picture/picture_file.h"
#include "terminal/command_line.h"
#include "terminal/program.h"

namespace {

using namespace qduino;

constexpr int kExitMatches = 0;
constexpr int kExitDiffers = 1;
constexpr int kExitUsage = 2;

constexpr apps::Fail fail{"printer-sim: ", kExitUsage};

/// What is written beside the summary; empty: it is not.
struct Outputs {
    std::string report;
    std::string picture;
    std::size_t layer = 0;  ///< of the picture, from 1; 0: all
    std::string kept;       ///< what M500 keeps
};

Result<void> draw(const apps::PrintResult& printed, const apps::PrintOptions& options,
                  const Outputs& outputs) {
    if (outputs.picture.empty() || !printed.observed) return {};
    apps::PartPictureOptions how{.title = std::filesystem::path{options.file}.filename().string(),
                                 .layer = std::nullopt,
                                 .line_mm = options.metal.nozzle_diameter_mm};
    if (outputs.layer > 0) how.layer = outputs.layer;
    QDUINO_TRY_ASSIGN(const std::string page, apps::part_picture(printed, how));
    return apps::picture::write_picture(outputs.picture, page);
}

int print(const apps::PrintOptions& options, const Outputs& outputs) {
    const Result<apps::PrintResult> printed = apps::print_file(options);
    if (isatty(STDERR_FILENO)) std::fprintf(stderr, "\r%60s\r", "");
    if (!printed.ok()) return fail(printed.error());
    std::fputs(apps::summary(*printed).c_str(), stdout);
    if (!outputs.report.empty()) {
        if (!posix::write_file(outputs.report, apps::to_json(*printed).dump(2) + '\n'))
            return fail(outputs.report + ": cannot be written");
    }
    const printer::link::KeptHeat& kept = printed->kept;
    if (!outputs.kept.empty() && kept.number > 0) {
        if (!posix::write_durably(outputs.kept, apps::kept_text(kept.hot_end, kept.bed, printed->kept_beds)))
            return fail(outputs.kept + ": cannot be written");
    }
    if (const Result<void> drawn = draw(*printed, options, outputs); !drawn) return fail(drawn.error());
    return printed->success() ? kExitMatches : kExitDiffers;
}

void show_progress(double fraction, double virtual_s) {
    std::fprintf(stderr, "\r%5.1f %%  %d:%02d:%02d printed ", fraction * 100,
                 static_cast<int>(virtual_s) / 3600, static_cast<int>(virtual_s) / 60 % 60,
                 static_cast<int>(virtual_s) % 60);
}

/// The command line.
struct Request {
    apps::PrintOptions print;
    apps::LiveOptions live;
    Outputs outputs;
    std::string machine_path, twin_path;
    std::vector<std::string> faults;
};

void declare(apps::CommandLine& line, Request& r) {
    line.option("FILE", r.print.file, "The G-code file");
    line.option("--before", r.print.before,
                "Print this file first, by the same printer; report and steps are of FILE alone");
    line.option("--link", r.live.link_path, "Instead of a file: serve a print service through this link");
    line.option("--inspect", r.live.inspect_path,
                "With --link: answer questions about the twin on this socket");
    line.option("--speed", r.live.speed, "With --link: virtual seconds per second")
        .within(0.01, 10000.0)
        .shows_default();
    line.option("--machine", r.machine_path,
                "Another printer than the reference machine (TOML, docs/machine.md)");
    line.option("--twin-machine", r.twin_path,
                "The machine that stands there in truth (keys as of --machine); left out: the one that "
                "the printer takes it for");
    line.option("--kept", r.outputs.kept,
                "File of the settings that M500 keeps (M301, M303, M306, beds): read before the machine "
                "file's numbers count, and written after a file that has M500 in it");
    line.option("--report", r.outputs.report, "Write the report here, as JSON");
    line.flag("--heights", r.print.heights,
              "Watch how high the plastic lies, how it oozes, and how long each kind of line takes");
    line.option("--picture", r.outputs.picture,
                "Draw the built part, its errors of height and its faults (.svg or .png)");
    line.option("--layer", r.outputs.layer, "With --picture: from above, this layer alone (from 1)");
    line.option("--board", r.print.board_name,
                "The simulated computer (TOML, docs/board-file.md, [sim]); its costs are reported");
    line.flag(
        "--prologue", r.print.prologue,
        "A job that brings no homing or no heating is homed and heated first ([start] of the machine file)");
    line.option("--steps", r.print.steps_path, "Write every step here: time_ns,axis,direction");
    line.option("--fault", r.faults,
                "Break something: KIND[:WHERE][@SECONDS], e.g. sensor_stuck:hot_end@120");
}

/// Reads the files that the command line names. A returned value is the status to leave with: one
/// is wrong, and the user was told.
std::optional<int> read_files(Request& r) {
    const Result<printer::MachineConfig> machine = apps::read_machine_files(r.machine_path, r.outputs.kept);
    if (!machine) return fail(machine.error());
    const Result<twin::Machine> metal = apps::read_twin_machine(r.twin_path, r.machine_path, *machine);
    if (!metal) return fail(metal.error());
    const auto faults = apps::parse_faults(r.faults);
    if (!faults) return fail(faults.error());
    r.live.machine = r.print.machine = *machine;
    r.live.metal = r.print.metal = *metal;
    r.print.faults = *faults;
    if (!r.print.board_name.empty()) {
        const apps::ReadBoardFile board = apps::read_board_file(r.print.board_name);
        if (!board.ok()) return fail(board.error);
        if (!board.board.parts.empty())
            return fail("the board file has a [[part]]: the printer's own machine is wired to this board");
        r.print.computer = board.board.sim;
    }
    if (r.outputs.picture.empty()) return std::nullopt;
    const Result<void> named = apps::picture::check_picture_name(r.outputs.picture);
    if (!named) return fail(named.error());
    r.print.heights = r.print.cells = true;
    return std::nullopt;
}

}  // namespace

int main(int argc, char** argv) {
    apps::CommandLine line{
        "Prints a G-code file in virtual time: the printer sketch, the simulated board and "
        "the virtual machine in one process. Ends with 0 only if what was built is what was asked.",
        "Example: printer-sim benchy.gcode --report report.json\n"
        "Live:    printer-sim --link /dev/shm/link --speed 20  (what ./run --speed starts)"};
    Request request;
    declare(line, request);
    if (const auto status = line.parse(argc, argv)) return *status;
    if (const auto status = read_files(request)) return *status;
    if (!request.live.link_path.empty()) {
        const Result<void> ended = apps::run_live(request.live);
        return ended.ok() ? 0 : fail(ended.error());
    }
    if (request.print.file.empty()) return fail("which file? (printer-sim --help)");
    if (isatty(STDERR_FILENO)) request.print.progress = show_progress;
    return print(request.print, request.outputs);
}
