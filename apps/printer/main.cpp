// printer: the printer sketch on the Linux board. Started by qduino-supervisor, which outlives it.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>

#include "PrinterWiring.h"
#include "apps/command_line/command_line.h"
#include "apps/guarantee/guarantee_report.h"
#include "apps/link/link_file.h"
#include "apps/machine_file/machine_file.h"
#include "apps/terminal/program.h"
#include "board/linux/linux_board.h"
#include "runtime/runtime.h"

namespace {

using namespace qduino;

constexpr apps::Fail fail{"printer: "};

struct Arguments {
    board::linux::LinuxConfig board;
    std::string link_path;
    std::string machine_path;
};

Result<void> run(const Arguments& arguments) {
    QDUINO_TRY_ASSIGN(const printer::MachineConfig machine, apps::read_machine_file(arguments.machine_path));
    QDUINO_TRY_ASSIGN(const auto board, board::linux::LinuxBoard::open(arguments.board));
    const auto started_s = static_cast<std::uint64_t>(std::time(nullptr));
    QDUINO_TRY_ASSIGN(const apps::LinkFile link, apps::create_link(arguments.link_path, started_s));

    sketches::printer_wiring() = {.config = machine, .link = link.get(), .measure_steps = true};
    runtime::Runtime runtime(*board);
    QDUINO_TRY(runtime.begin(runtime::sketch_table()));
    const board::GuaranteeReport report = board->guarantee();
    std::fputs(apps::guarantee_text(report).c_str(), stdout);
    std::fflush(stdout);
    link.get()->guarantee.write({std::string_view{apps::guarantee_json(report)}});
    runtime.run(kForever);
    std::fputs(apps::budgets_kept(board->guarantee()).c_str(), stdout);
    return {};
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{
        "The printer sketch on the Linux board, on the pins of a virtual machine.\n"
        "Example: printer --pins /dev/shm/qduino/pins --link /dev/shm/qduino/link"};
    Arguments arguments;
    app.add_option("--pins", arguments.board.pins_path, "File of the virtual pins, made by virtual-machine")
        ->required();
    app.add_option("--link", arguments.link_path, "File of the link to the print service; made anew")
        ->required();
    app.add_option("--machine", arguments.machine_path,
                   "Machine file (TOML); default: the reference machine");
    app.add_flag("--isolate", arguments.board.isolate,
                 "Move everything else off the stepper loop's core; undone at the end (root)");
    if (const auto status = apps::parse_command_line(app, argc, argv)) return *status;
    const Result<void> ended = run(arguments);
    return ended ? 0 : fail(ended.error());
}
