#include "qduino/arguments.h"

#include <algorithm>
#include <string_view>

#include "base/version.h"
#include "board/linux/kernel/host_settings.h"
#include "config/toml_section.h"
#include "qduino/common/host_name.h"
#include "report/picture/schedule.h"
#include "terminal/parser.h"

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

/// A subcommand that is about a sketch.
CLI::App* add_sketch_command(CLI::App& app, Arguments& arguments, Command command, const char* name,
                             const char* description, const char* footer) {
    CLI::App* sub = add_command(app, arguments, command, name, description, footer);
    add_sketch(*sub, arguments);
    return sub;
}

void add_length(CLI::App& sub, Arguments& arguments, const char* description) {
    add_option(sub, "--for", arguments.length_s, description, "S")->check(positive_number());
}

void add_board(CLI::App& sub, Arguments& arguments) {
    add_option(sub, "--board", arguments.board, "Board file (docs/board-file.md)", "FILE")
        ->check(CLI::ExistingFile);
}

void add_pins(CLI::App& sub, Arguments& arguments) {
    add_option(sub, "--pins", arguments.pins, "Virtual pins, as virtual-machine makes them", "FILE")
        ->check(CLI::ExistingFile);
}

void add_report(CLI::App& sub, Arguments& arguments) {
    add_option(sub, "--report", arguments.report, "Write the guarantees here, as JSON", "FILE");
}

void add_simulated_machine(CLI::App& sub, Arguments& arguments) {
    add_board(sub, arguments);
    add_option(sub, "--cores", arguments.cores, "Cores, 1 to 64 (default 2)", "N")
        ->check(whole_number_within(1, 64));
    add_option(sub, "--seed", arguments.seed, "Seed of what is random (default 1)", "N");
}

void add_picture(CLI::App& sub, Arguments& arguments, const char* description) {
    CLI::Option* picture = add_option(sub, "--picture", arguments.picture, description, "FILE");
    add_option(sub, "--from", arguments.picture_from_s, "The picture begins at this second", "S")
        ->check(number_within(0.0, picture::kLatestStart))
        ->needs(picture);
    add_option(sub, "--length", arguments.picture_length_s, "It shows so many (default: it suits)", "S")
        ->check(number_within(1e-6, picture::kLongest))
        ->needs(picture);
}

/// What shows the pins beside a picture.
void add_shown(CLI::App& sub, Arguments& arguments) {
    add_option(sub, "--vcd", arguments.vcd, "Write what the pins did here, for GTKWave", "FILE");
    sub.add_flag("--plain", arguments.plain, "No strips of blocks: for a screen reader");
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
        add_sketch_command(app, arguments, Command::build, "build", "Compile a sketch",
                           "Makes two programs, for the simulator and for Linux, in the cache\n"
                           "($XDG_CACHE_HOME/qduino), and prints their paths. Only what has changed is\n"
                           "made again. Errors point into the .ino. .cpp and .c files beside it, and in\n"
                           "src/, are compiled too. Honours CXX, CC, CXXFLAGS, CFLAGS, LDFLAGS.\n"
                           "Example: qduino build blinker --only linux --output /tmp");
    add_option(*sub, "--only", arguments.only, "One board: sim or linux", "BOARD")
        ->check(CLI::IsMember({"sim", "linux"}));
    add_option(*sub, "-o,--output", arguments.output, "Copy the programs into this folder", "DIR");
    sub->add_flag("--compile-commands", arguments.compile_commands,
                  "Write compile_commands.json, for clangd");
}

void add_run(CLI::App& app, Arguments& arguments) {
    CLI::App* sub =
        add_sketch_command(app, arguments, Command::run, "run", "Run a sketch here, in real time",
                           "Under qduino-supervisor: when the sketch dies or hangs, pins with a safe\n"
                           "state are forced to it. Says which guarantees hold. Ends with 2 when\n"
                           "admission refuses the sketch.\n"
                           "Example: qduino run blinker --for 10 --report guarantees.json");
    add_length(*sub, arguments, "Seconds (default: until Ctrl-C)");
    add_board(*sub, arguments);
    add_pins(*sub, arguments);
    sub->add_flag("--isolate", arguments.isolate, "Empty the cores that loops own (root)");
    sub->add_flag("--best-effort", arguments.best_effort, "Do not ask for real-time scheduling");
    add_picture(*sub, arguments, "Draw the pins, where they are connected to nothing: .svg");
    add_shown(*sub, arguments);
    add_report(*sub, arguments);
}

void add_sim(CLI::App& app, Arguments& arguments) {
    CLI::App* sub =
        add_sketch_command(app, arguments, Command::sim, "sim", "Run a sketch in the simulator",
                           "Virtual time: the same seed gives the same run, to the nanosecond. Ends\n"
                           "with 2 when admission refuses the sketch.\n"
                           "Example: qduino sim blinker --for 60 --picture blinker.svg");
    add_length(*sub, arguments, "Virtual seconds (default 10)");
    add_option(*sub, "--speed", arguments.speed, "Virtual seconds per second (default: all)", "K")
        ->check(positive_number());
    add_simulated_machine(*sub, arguments);
    add_picture(*sub, arguments, "Draw loops, pins, and R against T: .svg");
    add_shown(*sub, arguments);
    add_report(*sub, arguments);
}

void add_check(CLI::App& app, Arguments& arguments) {
    CLI::App* sub =
        add_sketch_command(app, arguments, Command::check, "check", "Would a sketch be admitted?",
                           "No loop runs. setup() runs, with nothing wired, only if the sketch has calls\n"
                           "that declare I/O VCPUs or critical sections, or route interrupts. Counts the\n"
                           "overheads that the board file names.\n"
                           "Ends with 0 when admitted, 2 when refused: then it names the loop, its R and\n"
                           "T, each one's share, and the smallest change that would be admitted.\n"
                           "Example: qduino check blinker.ino --cores 1 --json");
    sub->add_flag("--json", arguments.json, "As JSON (docs/qduino.md lists the keys)");
    add_option(*sub, "--certificate", arguments.certificate,
               "Write what was assumed and derived, for tools/check_certificate.py", "FILE");
    add_simulated_machine(*sub, arguments);
    add_picture(*sub, arguments, "Draw the worst case, and R against T: .svg");
    sub->add_flag("--plain", arguments.plain, "No strip of blocks: for a screen reader");
}

void add_trace(CLI::App& app, Arguments& arguments) {
    CLI::App* sub =
        add_sketch_command(app, arguments, Command::trace, "trace", "Record who ran when",
                           "Runs the sketch in the simulator and writes a file for ui.perfetto.dev or\n"
                           "chrome://tracing: releases, preemption, throttling, replenishment, overruns,\n"
                           "interrupts, per core. With --linux it runs in real time, and the kernel's\n"
                           "tracer records what the kernel knows: who ran when, wakes, preemption,\n"
                           "throttling, interrupts, but no overruns; root only.\n"
                           "Example: qduino trace blinker --for 2 -o blinker.json");
    add_option(*sub, "-o,--output", arguments.output, "File to write (default: NAME-trace.json)", "FILE");
    add_length(*sub, arguments, "Seconds (default 10)");
    add_picture(*sub, arguments, "Draw loops and pins as well, as .svg");
    add_shown(*sub, arguments);
    CLI::Option* on_linux = sub->add_flag("--linux", arguments.on_linux, "Trace a run on Linux (root)");
    add_simulated_machine(*sub, arguments);
    for (const char* simulated : {"--cores", "--seed"}) sub->get_option(simulated)->excludes(on_linux);
}

void add_profile(CLI::App& app, Arguments& arguments) {
    CLI::App* sub =
        add_sketch_command(app, arguments, Command::profile, "profile", "Measure loops, and suggest budgets",
                           "Runs the sketch and measures the CPU time of each release of a loop and each\n"
                           "run of a handler. Suggests C = the worst observed and a margin, and T, shows\n"
                           "the change of the sketch, and writes it with --write. Nothing is enforced\n"
                           "meanwhile; with --real-time all is as in `qduino run`.\n"
                           "Example: qduino profile blinker --for 60 --margin 50 --write");
    add_length(*sub, arguments, "Seconds (default 10)");
    add_option(*sub, "--margin", arguments.margin_percent, "Above the worst, in % (default 20)", "P")
        ->check(number_within(0.0, 1000.0));
    CLI::Option* write = sub->add_flag("--write", arguments.write, "Put the suggestions into the sketch");
    add_option(*sub, "-o,--output", arguments.output, "Keep the profile here, as JSON", "FILE");
    CLI::Option* real_time =
        sub->add_flag("--real-time", arguments.real_time, "Real-time scheduling, budgets enforced");
    sub->add_flag("--sim", arguments.in_simulator, "In the simulator: modelled times alone")
        ->excludes(write)
        ->excludes(real_time);
    add_board(*sub, arguments);
    add_pins(*sub, arguments);
}

/// A duration in milliseconds, or with its unit: "10", "0.5", "500us", "1s".
void add_duration(CLI::App& sub, const char* name, Nanoseconds& value, const char* description) {
    const auto take = [name, &value](const std::string& words) {
        const bool bare = words.find_first_not_of("0123456789.") == std::string::npos;
        const std::optional<Nanoseconds> read = parse_duration(bare ? words + "ms" : words);
        if (!read || *read <= Nanoseconds{0})
            throw CLI::ValidationError(name,
                                       "'" + words + "' is no duration above 0: write 10, 10ms, 500us or 1s");
        value = *read;
    };
    sub.add_option_function<std::string>(name, take, description)->option_text("MS");
}

void add_vcpu(CLI::App& app, Arguments& arguments) {
    CLI::App* sub =
        add_command(app, arguments, Command::vcpu, "vcpu", "Run any command in a VCPU",
                    "COMMAND and all that it starts get the budget in each period, if the loops on\n"
                    "that core leave it, and never more: the kernel's control groups keep it. Plain\n"
                    "numbers are milliseconds; 500us and 1s work as well. Ends as COMMAND does,\n"
                    "when its last process has ended; with 2 when admission refuses it.\n"
                    "Example: qduino vcpu --budget 10 --period 100 --core 0 -- make -j4");
    add_duration(*sub, "--budget", arguments.budget, "CPU time in each period (default 10 ms)");
    add_duration(*sub, "--period", arguments.period, "The period, up to 1 s (default 100 ms)");
    add_option(*sub, "--core", arguments.core, "The core (default: the first that admits it)", "N")
        ->check(whole_number_within(0, 1023));
    add_option(*sub, "--report", arguments.report, "Write guarantee and use here, as JSON", "FILE");
    sub->add_flag("-q,--quiet", arguments.quiet, "Say nothing but errors");
    sub->callback([&arguments] {
        arguments.command = Command::vcpu;
        if (arguments.program.empty()) throw CLI::RequiredError("COMMAND, what is to run in the VCPU,");
    });
}

/// Which emulator, and the way from its firmware to the image.
void add_metal_ways(CLI::App& sub, Arguments& arguments) {
    add_option(sub, "--arch", arguments.architecture, "build, run: x86-64 (default) or aarch64", "NAME")
        ->check(CLI::IsMember({"x86-64", "aarch64"}));
    add_option(sub, "--boot", arguments.boot, "pvh (default), bios or uefi", "WAY")
        ->check(CLI::IsMember({"pvh", "bios", "uefi"}));
    add_option(sub, "--witness", arguments.witness, "qemu (default) or bochs", "NAME")
        ->check(CLI::IsMember({"qemu", "bochs"}));
    add_option(sub, "--vcd", arguments.vcd, "Bochs: keep the pins' changes here, with their times", "FILE");
    add_option(sub, "--mips", arguments.mips, "Bochs: instructions in a microsecond (default 20)", "N")
        ->check(CLI::IsMember({1, 2, 4, 5, 8, 10, 20, 25, 40, 50, 100, 200, 250, 500}));
    add_option(sub, "-o,--output", arguments.output, "iso, efi: the file to make (default: in the cache)",
               "FILE");
}

/// Empty: `words` are two ports, "8080:80".
std::string port_pair_error(const std::string& words) {
    const auto is_port = [](const std::string& digits) {
        return !digits.empty() && digits.size() <= 5 &&
               digits.find_first_not_of("0123456789") == std::string::npos && std::stoi(digits) >= 1 &&
               std::stoi(digits) <= 65535;
    };
    const std::size_t colon = words.find(':');
    const bool good =
        colon != std::string::npos && is_port(words.substr(0, colon)) && is_port(words.substr(colon + 1));
    return good ? "" : "'" + words + "' is not a pair of ports from 1 to 65535, such as 8080:80";
}

void add_metal(CLI::App& app, Arguments& arguments) {
    CLI::App* sub =
        add_command(app, arguments, Command::metal, "metal", "Boot a sketch without Linux",
                    "'build' makes an image in the cache and prints its path: the\n"
                    "sketch and the scheduler, no operating system. 'iso' makes a CD of it that a\n"
                    "BIOS boots, 'efi' a program that UEFI starts. 'run' boots it in an emulator:\n"
                    "Serial is this terminal, reports are beside it, and what was written to the\n"
                    "pins is seen from outside. 'beside' runs it on a core of this computer that\n"
                    "Linux gives up meanwhile (root; docs/metal.md): SKETCH may be an image there.\n"
                    "'run' takes one, too. Ends with 2 when admission refuses the sketch.\n"
                    "Example: qduino metal run sketches/pulse_train --for 1");
    add_option(*sub, "action", arguments.action, "build, iso, efi, run or beside", "ACTION")
        ->required()
        ->check(CLI::IsMember({"build", "iso", "efi", "run", "beside"}));
    add_sketch(*sub, arguments);
    add_length(*sub, arguments, "Seconds of the machine (default: until Ctrl-C)");
    add_option(*sub, "--cores", arguments.cores, "Cores, 1 to 8 (default 2)", "N")
        ->check(whole_number_within(1, 8));
    sub->add_flag("--deterministic", arguments.counted_time, "Time counts instructions: repeatable");
    add_option(*sub, "--card", arguments.card, "A network card: virtio-net or e1000", "CARD")
        ->check(CLI::IsMember({"virtio-net", "e1000"}));
    add_option(*sub, "--forward", arguments.forwards, "A TCP port here is one there: 8080:80", "PORT:PORT")
        ->check(CLI::Validator(port_pair_error, "PORT:PORT"));
    add_option(*sub, "--wire", arguments.wire, "Make a socket that drives pins, a byte a change", "FILE");
    add_option(*sub, "--window", arguments.window, "Virtual pins that it shares with another program",
               "FILE");
    add_option(*sub, "--files", arguments.files, "Files that the machine can read", "FOLDER")
        ->check(CLI::ExistingDirectory);
    add_option(*sub, "--words", arguments.image_words, "What the image is told besides: \"name=value …\"",
               "WORDS");
    add_option(*sub, "--record", arguments.record, "Keep here a byte for each write to a pin", "FILE");
    add_option(*sub, "--core", arguments.core, "beside: the core that Linux gives up (default 1)", "N")
        ->check(whole_number_within(1, 7));
    add_option(*sub, "--silence", arguments.silence_ms,
               "beside: when Linux is silent so long, safe levels (default 5; 0: it runs on)", "MS")
        ->check(number_within(0.0, 10000.0));
    add_option(*sub, "--link", arguments.link, "beside: make a printer's link for printd here", "FILE");
    add_metal_ways(*sub, arguments);
}

void add_lib(CLI::App& app, Arguments& arguments) {
    CLI::App* sub = add_command(app, arguments, Command::lib, "lib", "Install Arduino libraries",
                                "Into the first folder of QDUINO_LIBRARIES, else ~/Arduino/libraries, where\n"
                                "every sketch finds them by the headers that it includes. 'install' takes a\n"
                                "folder, a zip, a git URL (URL#TAG), or NAME or NAME@VERSION of Arduino's\n"
                                "index, with what it depends on; SHA-256 is verified. 'search' looks for\n"
                                "words in the index.\n"
                                "Example: qduino lib install Bounce2");
    add_option(*sub, "action", arguments.action, "install, list, remove or search", "ACTION")
        ->required()
        ->check(CLI::IsMember({"install", "list", "remove", "search"}));
    add_option(*sub, "what", arguments.words, "Libraries, or words to look for", "[WHAT...]");
}

void add_to(CLI::App& sub, Arguments& arguments) {
    add_option(sub, "--to", arguments.to, "Another computer, by ssh", "USER@HOST")
        ->check(CLI::Validator(host_error, "USER@HOST"));
}

void add_upload(CLI::App& app, Arguments& arguments) {
    CLI::App* sub =
        add_sketch_command(app, arguments, Command::upload, "upload", "Start a sketch, and leave it running",
                           "Builds the sketch, checks it, ends the one that was uploaded before, and starts\n"
                           "this one under qduino-supervisor, as 'qduino run' does. It runs on when you log\n"
                           "out; 'qduino monitor' is its Serial. With --to the sketch and its libraries are\n"
                           "sent to another computer as sources, and built and judged there.\n"
                           "Ends with 2 when admission refuses it: the old one then runs on.\n"
                           "Example: qduino upload blinker --to pi@printer.local");
    add_to(*sub, arguments);
    sub->add_flag("--stop", arguments.stop, "End the sketch that was uploaded");
    add_option(*sub, "--board", arguments.board, "Board file of the computer that runs it", "FILE");
    sub->add_flag("--isolate", arguments.isolate, "Empty the cores that loops own (root)");
    sub->add_flag("--best-effort", arguments.best_effort, "Do not ask for real-time scheduling");
    add_option(*sub, "--built", arguments.built, "What the Arduino IDE has built", "BUILD/NAME");
    sub->add_flag("--from-stdin", arguments.from_stdin, "The sketch comes as a tar: --to does this");
}

void add_monitor(CLI::App& app, Arguments& arguments) {
    CLI::App* sub =
        add_command(app, arguments, Command::monitor, "monitor", "Serial of an uploaded sketch",
                    "Shows what the sketch prints, first its last 64 KiB, and sends it what you\n"
                    "type, a line at a time. Several may look at once. --plot prints an address: a\n"
                    "page of this computer that draws lines such as 'in:23.5,out:40' as curves, as\n"
                    "the Arduino IDE's plotter does. Ends with the sketch, or at Ctrl-C.\n"
                    "Example: qduino monitor --to pi@printer.local --timestamps");
    add_to(*sub, arguments);
    CLI::Option* raw = sub->add_flag("--raw", arguments.raw, "Bytes as they are, both ways");
    sub->add_flag("--timestamps", arguments.timestamps, "The time in front of each line")->excludes(raw);
    add_option(*sub, "--line-end", arguments.line_end, "Of lines you type: nl (default), cr, crlf, none",
               "END")
        ->check(CLI::IsMember({"nl", "cr", "crlf", "none"}))
        ->excludes(raw);
    CLI::Option* plot = sub->add_flag("--plot", arguments.plot, "Curves in a browser")->excludes(raw);
    add_option(*sub, "--port", arguments.plot_port, "The page's port (default: a free one)", "N")
        ->check(whole_number_within(1, 65535))
        ->needs(plot);
    add_option(*sub, "--tty", arguments.tty, "A serial port for other programs, until Ctrl-C", "LINK")
        ->excludes(raw)
        ->excludes(plot)
        ->excludes("--timestamps")
        ->excludes("--line-end");
}

void add_ide(CLI::App& app, Arguments& arguments) {
    CLI::App* sub =
        add_command(app, arguments, Command::ide, "ide", "Build with the Arduino IDE",
                    "'install' makes this board one of the IDE's (and of arduino-builder's):\n"
                    "FOLDER is its sketchbook, ~/Arduino by default. The IDE then builds with the\n"
                    "options of 'qduino build', shows the verdict of admission, and uploads with\n"
                    "'qduino upload'. 'remove' takes the board away. The other actions are what\n"
                    "the board's platform.txt calls.\n"
                    "Example: qduino ide install --to pi@printer.local");
    add_option(*sub, "action", arguments.action, "install or remove", "ACTION")
        ->required()
        ->check(CLI::IsMember({"install", "remove", "preprocess", "compile", "link", "check", "size",
                               "discovery", "serial", "monitor"}));
    add_option(*sub, "folder", arguments.folder, "The IDE's sketchbook", "[FOLDER]");
    add_option(*sub, "--to", arguments.hosts, "A board more: this computer, by ssh", "USER@HOST")
        ->check(CLI::Validator(host_error, "USER@HOST"));
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

/// Where the command begins in the words behind "vcpu".
int begin_of_program(const CLI::App& vcpu, int argc, const char* const* argv) {
    int at = 2;
    while (at < argc) {
        const std::string word = argv[at];
        if (word == "--" || word[0] != '-') break;
        const CLI::Option* option = vcpu.get_option_no_throw(word);
        at += option && option->get_items_expected_max() > 0 ? 2 : 1;
    }
    return std::min(at, argc);
}

}  // namespace

int take_program(const CLI::App& parser, Arguments& arguments, int argc, const char* const* argv) {
    constexpr int kWordsOfRecipe = 3;  // qduino ide compile
    const bool recipe = argc > kWordsOfRecipe && argv[1] == std::string_view{"ide"} && argv[2][0] != '-' &&
                        argv[2] != std::string_view{"install"} && argv[2] != std::string_view{"remove"};
    if (recipe) {
        arguments.program.assign(argv + kWordsOfRecipe, argv + argc);
        return kWordsOfRecipe;
    }
    if (argc < 2 || argv[1] != std::string_view{"vcpu"}) return argc;
    const int at = begin_of_program(*parser.get_subcommand("vcpu"), argc, argv);
    const int first = at < argc && argv[at] == std::string_view{"--"} ? at + 1 : at;
    arguments.program.assign(argv + first, argv + argc);
    return at;
}

std::unique_ptr<CLI::App> make_parser(Arguments& arguments) {
    auto app = std::make_unique<CLI::App>(
        "Sketches with several loops, each with a budget, a period and a core.", "qduino");
    app->footer(
        "Example: qduino new blinker && cd blinker && qduino check && qduino run\n"
        "'qduino help COMMAND' says more. Ends with 0 when all is well, 1 on failure, 2\n"
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
    add_profile(*app, arguments);
    add_vcpu(*app, arguments);
    add_metal(*app, arguments);
    add_lib(*app, arguments);
    add_upload(*app, arguments);
    add_monitor(*app, arguments);
    add_ide(*app, arguments);
    add_machine_commands(*app, arguments);
    return app;
}

}  // namespace qduino::apps
