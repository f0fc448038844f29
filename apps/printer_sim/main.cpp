// printer-sim: prints a G-code file in virtual time and reports whether the built part is the one
// that was asked for.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "apps/command_line/command_line.h"
#include "apps/machine_file/machine_file.h"
#include "apps/machine_file/twin_machine.h"
#include "apps/printer_sim/print_file.h"
#include "apps/printer_sim/sim_printer.h"
#include "apps/terminal/program.h"
#include "posix/small_file.h"

namespace {

using namespace qduino;

constexpr int kExitMatches = 0;
constexpr int kExitDiffers = 1;
constexpr int kExitUsage = 2;

constexpr apps::Fail fail{"printer-sim: ", kExitUsage};

int print(const apps::PrintOptions& options, const std::string& report_path) {
    const Result<apps::PrintResult> printed = apps::print_file(options);
    if (isatty(STDERR_FILENO)) std::fprintf(stderr, "\r%60s\r", "");
    if (!printed.ok()) return fail(printed.error());
    std::fputs(apps::summary(*printed).c_str(), stdout);
    if (!report_path.empty()) {
        if (!posix::write_file(report_path, apps::to_json(*printed).dump(2) + '\n'))
            return fail(report_path + ": cannot be written");
    }
    return printed->success() ? kExitMatches : kExitDiffers;
}

void show_progress(double fraction, double virtual_s) {
    std::fprintf(stderr, "\r%5.1f %%  %d:%02d:%02d printed ", fraction * 100,
                 static_cast<int>(virtual_s) / 3600, static_cast<int>(virtual_s) / 60 % 60,
                 static_cast<int>(virtual_s) % 60);
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{
        "Prints a G-code file in virtual time: the printer sketch, the simulated board and "
        "the virtual machine in one process. Ends with 0 only if what was built is what was asked."};
    apps::PrintOptions options;
    std::string machine_path, twin_path, report_path;
    std::vector<std::string> faults;
    apps::LiveOptions live;
    app.footer(
        "Example: printer-sim benchy.gcode --report report.json\n"
        "Live:    printer-sim --link /dev/shm/link --speed 20  (what ./run --speed starts)");
    app.add_option("FILE", options.file, "The G-code file");
    app.add_option("--link", live.link_path, "Instead of a file: serve a print service through this link");
    app.add_option("--inspect", live.inspect_path,
                   "With --link: answer questions about the twin on this socket");
    app.add_option("--speed", live.speed, "With --link: virtual seconds per second")
        ->check(CLI::Range(0.01, 10000.0))
        ->capture_default_str();
    app.add_option("--machine", machine_path,
                   "Another printer than the reference machine (TOML, docs/machine.md)");
    app.add_option("--twin-machine", twin_path,
                   "The machine that stands there in truth (keys as of --machine); left out: the one that "
                   "the printer takes it for");
    app.add_option("--report", report_path, "Write the report here, as JSON");
    app.add_option("--steps", options.steps_path, "Write every step here: time_ns,axis,direction");
    app.add_option("--fault", faults,
                   "Break something: KIND[:WHERE][@SECONDS], e.g. sensor_stuck:hot_end@120");
    if (const auto status = apps::parse_command_line(app, argc, argv)) return *status;

    const Result<printer::MachineConfig> machine = apps::read_machine_file(machine_path);
    if (!machine) return fail(machine.error());
    const Result<twin::Machine> metal = apps::read_twin_machine(twin_path, machine_path, *machine);
    if (!metal) return fail(metal.error());
    const auto parsed = apps::parse_faults(faults);
    if (!parsed) return fail(parsed.error());
    live.machine = options.machine = *machine;
    live.metal = options.metal = *metal;
    options.faults = *parsed;
    if (!live.link_path.empty()) {
        const Result<void> ended = apps::run_live(live);
        return ended.ok() ? 0 : fail(ended.error());
    }
    if (options.file.empty()) return fail("which file? (printer-sim --help)");
    if (isatty(STDERR_FILENO)) options.progress = show_progress;
    return print(options, report_path);
}
