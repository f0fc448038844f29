#include "apps/qduino/arguments.h"

#include "apps/command_line/command_line.h"
#include "base/version.h"
#include "board/linux/host_settings.h"

namespace qduino::apps {
namespace {

// Descriptions fit their column: with 28 columns to the left, a line of 80 has 52 for them. (A test
// measures every page.)
constexpr std::size_t kColumn = 28;

/// A subcommand with its example; parsing it sets `command`.
CLI::App* add_command(CLI::App& app, Arguments& arguments, Command command, const char* name,
                      const char* description, const char* footer) {
    CLI::App* sub = app.add_subcommand(name, description);
    sub->footer(footer);
    sub->get_formatter()->column_width(kColumn);
    sub->callback([&arguments, command] { arguments.command = command; });
    return sub;
}

void add_sketch(CLI::App& sub, Arguments& arguments) {
    add_option(sub, "sketch", arguments.sketch, "Folder or .ino (default: this folder)", "[SKETCH]");
    sub.add_flag("-v,--verbose", arguments.verbose, "Show the commands that build it");
}

void add_length(CLI::App& sub, Arguments& arguments, const char* description) {
    add_option(sub, "--for", arguments.length_s, description, "S")->check(CLI::PositiveNumber);
}

void add_board(CLI::App& sub, Arguments& arguments) {
    add_option(sub, "--board", arguments.board, "Board file (docs/board-file.md)", "FILE")
        ->check(CLI::ExistingFile);
}

void add_report(CLI::App& sub, Arguments& arguments) {
    add_option(sub, "--report", arguments.report, "Write the guarantees here, as JSON", "FILE");
}

void add_simulated_machine(CLI::App& sub, Arguments& arguments) {
    add_board(sub, arguments);
    add_option(sub, "--cores", arguments.cores, "Cores, 1 to 64 (default 2)", "N")->check(CLI::Range(1, 64));
    add_option(sub, "--seed", arguments.seed, "Seed of what is random (default 1)", "N");
}

void add_new(CLI::App& app, Arguments& arguments) {
    CLI::App* sub = add_command(app, arguments, Command::make_new, "new", "Make a sketch to begin with",
                                "Makes the folder NAME with NAME.ino: two loops, ready to run.\n"
                                "Overwrites nothing.\n"
                                "Example: qduino new blinker && cd blinker && qduino sim");
    add_option(*sub, "name", arguments.name, "Name, or path, of the new folder", "NAME")->required();
}

void add_build(CLI::App& app, Arguments& arguments) {
    CLI::App* sub =
        add_command(app, arguments, Command::build, "build", "Compile a sketch",
                    "Makes two programs, for the simulator and for Linux, in the cache\n"
                    "($XDG_CACHE_HOME/qduino), and prints their paths. Only what has changed is\n"
                    "made again. Errors point into the .ino. .cpp and .c files beside it, and in\n"
                    "src/, are compiled too. Honours CXX, CC, CXXFLAGS, CFLAGS, LDFLAGS.\n"
                    "Example: qduino build blinker --only linux --output /tmp");
    add_sketch(*sub, arguments);
    add_option(*sub, "--only", arguments.only, "One board: sim or linux", "BOARD")
        ->check(CLI::IsMember({"sim", "linux"}));
    add_option(*sub, "-o,--output", arguments.output, "Copy the programs into this folder", "DIR");
}

void add_run(CLI::App& app, Arguments& arguments) {
    CLI::App* sub = add_command(app, arguments, Command::run, "run", "Run a sketch here, in real time",
                                "Under qduino-supervisor: when the sketch dies or hangs, pins with a safe\n"
                                "state are forced to it. Says which guarantees hold. Ends with 2 when\n"
                                "admission refuses the sketch.\n"
                                "Example: qduino run blinker --for 10 --report guarantees.json");
    add_sketch(*sub, arguments);
    add_length(*sub, arguments, "Seconds (default: until Ctrl-C)");
    add_board(*sub, arguments);
    add_option(*sub, "--pins", arguments.pins, "Virtual pins, as virtual-machine makes them", "FILE")
        ->check(CLI::ExistingFile);
    sub->add_flag("--isolate", arguments.isolate, "Empty the cores that loops own (root)");
    sub->add_flag("--best-effort", arguments.best_effort, "Do not ask for real-time scheduling");
    add_report(*sub, arguments);
}

void add_sim(CLI::App& app, Arguments& arguments) {
    CLI::App* sub = add_command(app, arguments, Command::sim, "sim", "Run a sketch in the simulator",
                                "Virtual time: the same seed gives the same run, to the nanosecond. Ends\n"
                                "with 2 when admission refuses the sketch.\n"
                                "Example: qduino sim blinker --for 60 --board loaded.toml --seed 7");
    add_sketch(*sub, arguments);
    add_length(*sub, arguments, "Virtual seconds (default 10)");
    add_option(*sub, "--speed", arguments.speed, "Virtual seconds per second (default: all)", "K")
        ->check(CLI::PositiveNumber);
    add_simulated_machine(*sub, arguments);
    add_report(*sub, arguments);
}

void add_check(CLI::App& app, Arguments& arguments) {
    CLI::App* sub =
        add_command(app, arguments, Command::check, "check", "Would a sketch be admitted?",
                    "No loop runs. setup() runs, with nothing wired, only if the sketch has calls\n"
                    "that declare I/O VCPUs or critical sections, or route interrupts. Counts the\n"
                    "overheads that the board file names.\n"
                    "Ends with 0 when admitted, 2 when refused: then it names the loop, its R and\n"
                    "T, each one's share, and the smallest change that would be admitted.\n"
                    "Example: qduino check blinker.ino --cores 1 --json");
    add_sketch(*sub, arguments);
    sub->add_flag("--json", arguments.json, "As JSON (docs/qduino.md lists the keys)");
    add_option(*sub, "--certificate", arguments.certificate,
               "Write what was assumed and derived, for tools/check_certificate.py", "FILE");
    add_simulated_machine(*sub, arguments);
}

void add_trace(CLI::App& app, Arguments& arguments) {
    CLI::App* sub =
        add_command(app, arguments, Command::trace, "trace", "Record who ran when",
                    "Runs the sketch in the simulator and writes a file for ui.perfetto.dev or\n"
                    "chrome://tracing: releases, preemption, throttling, replenishment, overruns,\n"
                    "interrupts, per core. With --linux it runs in real time, and the kernel's\n"
                    "tracer records what the kernel knows: who ran when, wakes, preemption,\n"
                    "throttling, interrupts, but no overruns; root only.\n"
                    "Example: qduino trace blinker --for 2 -o blinker.json");
    add_sketch(*sub, arguments);
    add_option(*sub, "-o,--output", arguments.output, "File to write (default: NAME-trace.json)", "FILE");
    add_length(*sub, arguments, "Seconds (default 10)");
    CLI::Option* on_linux = sub->add_flag("--linux", arguments.on_linux, "Trace a run on Linux (root)");
    add_simulated_machine(*sub, arguments);
    for (const char* simulated : {"--cores", "--seed"}) sub->get_option(simulated)->excludes(on_linux);
}

void add_machine_commands(CLI::App& app, Arguments& arguments) {
    CLI::App* doctor =
        add_command(app, arguments, Command::doctor, "doctor", "Is this computer fit for real time?",
                    "Changes nothing; names the exact fix for each shortfall. Ends with 0 when\n"
                    "nothing needs fixing, 1 otherwise.\n"
                    "Example: qduino doctor --json");
    doctor->add_flag("--json", arguments.json, "As JSON");
    CLI::App* restore =
        add_command(app, arguments, Command::restore, "restore", "Undo what a dead sketch left changed",
                    "A sketch that isolates cores writes each change to the computer down before\n"
                    "it makes it. This undoes what a killed one could not.\n"
                    "Example: sudo qduino restore");
    arguments.settings_state = board::linux::kDefaultSettingsState;
    add_option(*restore, "--state", arguments.settings_state, "Where changes are written down", "FILE");
    CLI::App* completion =
        add_command(app, arguments, Command::completion, "completion", "Print a shell's completion script",
                    "bash:    qduino completion bash >\n"
                    "           ~/.local/share/bash-completion/completions/qduino\n"
                    "zsh:     qduino completion zsh > a folder of $fpath/_qduino\n"
                    "fish:    qduino completion fish > ~/.config/fish/completions/qduino.fish\n"
                    "Example: source <(qduino completion bash)");
    add_option(*completion, "shell", arguments.shell, "bash, zsh or fish", "SHELL")
        ->required()
        ->check(CLI::IsMember({"bash", "zsh", "fish"}));
}

}  // namespace

std::unique_ptr<CLI::App> make_parser(Arguments& arguments) {
    auto app = std::make_unique<CLI::App>(
        "Sketches with several loops, each with a budget, a period and a core.", "qduino");
    app->footer(
        "Example: qduino new blinker && cd blinker && qduino check && qduino run\n"
        "'qduino COMMAND --help' says more. Ends with 0 when all is well, 1 on failure, 2\n"
        "when admission refuses the sketch, above 100 when it was called wrongly.");
    app->get_formatter()->column_width(kColumn);
    app->set_version_flag("--version", std::string("qduino ").append(version()), "Print the version");
    app->require_subcommand(1);
    add_new(*app, arguments);
    add_build(*app, arguments);
    add_run(*app, arguments);
    add_sim(*app, arguments);
    add_check(*app, arguments);
    add_trace(*app, arguments);
    add_machine_commands(*app, arguments);
    return app;
}

}  // namespace qduino::apps
