// printer: the printer sketch on the Linux board. Started by qduino-supervisor, which outlives it.
#include <unistd.h>

#include <cstdio>
#include <ctime>
#include <string>
#include <string_view>
#include <vector>

#include "PrinterWiring.h"
#include "board/linux/linux_board.h"
#include "config/machine_check.h"
#include "config/machine_file.h"
#include "config/macro_check.h"
#include "link/link_file.h"
#include "link/live_guarantee.h"
#include "posix/small_file.h"
#include "report/guarantee_report.h"
#include "report/sketch_report.h"
#include "runtime/runtime.h"
#include "terminal/command_line.h"
#include "terminal/program.h"

namespace {

using namespace qduino;

constexpr apps::Fail fail{"printer: "};

// sketches/printer/printer.ino
constexpr board::VcpuId kStepperLoop = 2;
constexpr board::VcpuId kHeaterLoop = 3;

struct Arguments {
    board::linux::LinuxConfig board;
    std::string link_path;
    std::string machine_path;
    std::string kept_path;
    std::string report_path;  ///< empty: nobody wants it
};

/// Two lines for the launcher's first screen, and the report (apps/launcher/sketch_report.h).
/// Without the print service, which takes what fits only when the loops run: the launcher has that.
std::string start_report(board::GuaranteeReport report, const runtime::Plan& plan) {
    const auto others = report.trees;
    report.trees.clear();
    for (const board::TreeGuarantee& tree : others) {
        if (tree.name.view() != "print service") report.trees.push_back(tree);
    }
    std::string steps = "NO (there is no such loop)", heat = steps;
    std::string where = "Real time; the stepper has no core of its own.";
    for (const board::LoopGuarantee& loop : report.loops) {
        if (loop.id == kStepperLoop) steps = apps::in_a_word(loop);
        if (loop.id == kHeaterLoop) heat = apps::in_a_word(loop);
        if (loop.id == kStepperLoop && loop.core_owned)
            where = text<std::string>("Real time, core ", loop.core, " is the stepper's.");
        if (loop.id == kStepperLoop && !loop.priority_enforced)
            where = "NOT in real time: ordinary priority.";
    }
    sched::Explanation chains;
    for (const runtime::ChainVerdict& chain : plan.chains()) runtime::explain(chains, chain);
    return text<std::string>(where, "\nsteps ", steps, ", heat ", heat, "\n\n", apps::guarantee_text(report),
                             chains);
}

/// For printer-port, which does the bottom half of a serial host's port.
void publish_port(const board::linux::LinuxBoard& board, printer::link::LinkLayout& link) {
    const auto io = board.serving(board::DeviceClass::uart);
    if (!io) return;
    const Nanoseconds client = io->spec.client_period;
    link.port_vcpu.publish({.core = io->spec.core,
                            .priority = io->priority,
                            .budget = io->spec.budget,
                            .period = io->spec.period,
                            .client = client > Nanoseconds{0} ? client : io->spec.period});
}

Result<void> run(const Arguments& arguments) {
    QDUINO_TRY_ASSIGN(const printer::MachineConfig machine,
                      apps::read_machine_files(arguments.machine_path, arguments.kept_path));
    QDUINO_TRY_ASSIGN(const auto board, board::linux::LinuxBoard::open(arguments.board));
    const auto started_s = static_cast<std::uint64_t>(std::time(nullptr));
    QDUINO_TRY_ASSIGN(const apps::LinkFile link, apps::create_link(arguments.link_path, started_s));

    sketches::printer_wiring() = {.config = machine, .link = link.get(), .measure_steps = true};
    runtime::Runtime runtime(*board);
    if (Result<void> begun = runtime.begin(runtime::sketch_table()); !begun) {
        if (!runtime.plan().admitted()) fail(runtime.explanation().view());
        return begun;
    }
    publish_port(*board, *link.get());
    const board::GuaranteeReport report = board->guarantee();
    const std::string words = start_report(report, runtime.plan());
    std::fputs(words.c_str(), stdout);
    std::fflush(stdout);
    if (!arguments.report_path.empty()) QDUINO_TRY(posix::write_file(arguments.report_path, words));
    apps::run_and_publish(*link.get(), runtime);
    const board::GuaranteeReport end = apps::guarantee_of(runtime);
    std::fputs(text<std::string>(apps::run_report(runtime, board->now()), apps::delays_explained(end),
                                 apps::budgets_kept(end))
                   .c_str(),
               stdout);
    if (board->loops_ended()) return {};
    // What they use would be destroyed under them.
    std::fflush(stdout);
    fail(apps::loops_left(apps::loops_of(runtime)) + "; the printer is ended as it is, with its safe states");
    board->abandon();
    ::_exit(1);
}

/// `printer check FILE…`: 0 when every file is a machine.
int check(int argc, char** argv) {
    apps::CommandLine line{
        "Reads machine files as the printer would: says what is wrong, with its line, or what the "
        "machine is.\nExample: printer check machines/i3.toml"};
    std::vector<std::string> paths;
    line.name("printer check");
    line.option("FILE", paths, "Machine files (TOML, docs/machine.md)").required();
    if (const auto status = line.parse(argc, argv)) return *status;
    int status = 0;
    for (const std::string& path : paths) {
        const Result<std::string> text = posix::read_small_file(path);
        printer::MachineConfig machine;
        const std::string error =
            text ? apps::machine_error(*text, path, machine) : path + " cannot be read: check its path";
        if (!error.empty()) {
            status = fail(error);
            continue;
        }
        std::fputs(apps::describe(machine, path).c_str(), stdout);
        if (const std::string wrong = apps::macro_errors(machine); !wrong.empty())
            status =
                fail(qduino::text<std::string>(path, ": a job that needs one of these is refused:\n", wrong));
    }
    return status;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc > 1 && std::string_view{argv[1]} == "check") return check(argc - 1, argv + 1);
    apps::CommandLine line{
        "The printer sketch on the Linux board, on the pins of a virtual machine.\n"
        "Example: printer --pins /dev/shm/qduino/pins --link /dev/shm/qduino/link\n"
        "         printer check machines/i3.toml      is this machine file right?"};
    Arguments arguments;
    line.option("--pins", arguments.board.pins_path, "File of the virtual pins, made by virtual-machine")
        .required();
    line.option("--link", arguments.link_path, "File of the link to the print service; made anew").required();
    line.option("--machine", arguments.machine_path, "Machine file (TOML); default: the reference machine");
    line.option("--kept", arguments.kept_path,
                "File of the settings that M500 keeps; they go before the machine file's");
    line.option("--report", arguments.report_path, "File for what holds at the start (the launcher's)");
    line.flag("--isolate", arguments.board.isolate,
              "Move everything else off the stepper loop's core; undone at the end (root)");
    if (const auto status = line.parse(argc, argv)) return *status;
    const Result<void> ended = run(arguments);
    return ended ? 0 : fail(ended.error());
}
