// The command line of `qduino`: its options, and the values given.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/time.h"

namespace CLI {
class App;
}

namespace qduino::apps {

enum class Command {
    make_new,
    build,
    run,
    sim,
    check,
    trace,
    profile,
    vcpu,
    metal,
    lib,
    upload,
    monitor,
    ide,
    doctor,
    restore,
    completion
};

struct Arguments {
    Command command{};
    std::string sketch = ".";  ///< folder or .ino
    bool verbose = false;
    std::string name;    ///< new
    std::string only;    ///< build: "sim", "linux" or empty
    std::string output;  ///< build: folder; trace, profile, metal: file
    std::optional<double> length_s;
    std::optional<double> speed;
    std::optional<int> cores;
    std::optional<std::uint64_t> seed;
    std::string board, pins, report;
    std::string picture;  ///< sim, check, trace: file
    std::optional<double> picture_from_s, picture_length_s;
    std::string vcd;        ///< run, sim, trace, metal: where the pins' changes go; empty: none
    bool plain = false;     ///< run, sim, check, trace: no strips of blocks
    std::string admission;  ///< where a run on Linux writes it; no option
    bool isolate = false, best_effort = false;
    bool on_linux = false;  ///< trace
    // profile:
    bool in_simulator = false, real_time = false, write = false;
    double margin_percent = 20;
    std::string profile;  ///< where the sketch's program writes it
    /// metal: "build", "iso", "efi", "run" or "beside"; lib: "install", "list", "remove" or
    /// "search"; ide: "install", "remove" or a recipe
    std::string action;
    std::vector<std::string> words;  ///< lib: what to install, remove or look for
    // metal run:
    std::string architecture;   ///< "x86-64" or "aarch64"; empty: "x86-64"
    std::string boot;           ///< "pvh", "bios" or "uefi"; empty: "pvh"
    std::string witness;        ///< "qemu" or "bochs"; empty: "qemu"
    int mips = 20;              ///< of the machine in Bochs
    std::string record;         ///< what the witness writes at the pins; empty: kept nowhere
    std::string wire;           ///< a socket through which pins are driven from outside
    bool counted_time = false;  ///< time is a count of instructions
    std::string link;           ///< beside: file for a print service; empty: none
    double silence_ms = 5;      ///< beside: of Linux, before the safe levels are driven; 0: no end
    std::string card;           ///< the machine's network card; empty: it has none
    /// "PORT:PORT", one of this computer and one of the machine; then it has a card, too.
    std::vector<std::string> forwards;
    std::string files;        ///< a folder whose files the machine can read; empty: none
    std::string window;       ///< a file of virtual pins that the machine shares; empty: none
    std::string image_words;  ///< more of what the image is told
    bool json = false;
    std::string certificate;  ///< check: file
    // vcpu: the paper's default VCPU (RTAS 2017, section IV), unless others are named
    Nanoseconds budget = 10ms, period = 100ms;
    std::optional<int> core;
    bool quiet = false;
    std::vector<std::string> program;  ///< vcpu: the command; ide: a recipe's words
    std::string folder;                ///< ide: the sketchbook
    std::vector<std::string> hosts;    ///< ide: "user@host", as ssh takes it
    bool compile_commands = false;     ///< build
    // upload, monitor:
    std::string to;           ///< "user@host", as ssh takes it; empty: this computer
    std::string built;        ///< upload: what the IDE has built, BUILD/NAME; empty: nothing
    bool stop = false;        ///< upload: end the sketch that runs
    bool from_stdin = false;  ///< upload: the sketch comes as a tar on standard input
    bool raw = false, timestamps = false;
    std::string line_end = "nl";
    std::string tty;  ///< monitor: a link to a terminal; empty: none
    bool plot = false;
    int plot_port = 0;
    std::string settings_state;  ///< restore
    std::string shell;           ///< completion
};

/// The parser, which fills in `arguments`; that outlives it.
[[nodiscard]] std::unique_ptr<CLI::App> make_parser(Arguments& arguments);

/// Takes the command of `qduino vcpu`, and all behind it, into `arguments`: it may look like
/// options of `qduino`. Returns how many words are left to parse. Before the parsing.
int take_program(const CLI::App& parser, Arguments& arguments, int argc, const char* const* argv);

/// The completion script of `parser` for a shell, "bash", "zsh" or "fish"; anything else gives an
/// empty text.
[[nodiscard]] std::string completion_script(const CLI::App& parser, const std::string& shell);

/// Carries out `arguments.command`. Returns the exit status: 0, 1 on failure, 2 when admission
/// refuses the sketch or the tree; that of the command, for `vcpu`. `parser` is for `completion`.
int run_command(const Arguments& arguments, const CLI::App& parser);

}  // namespace qduino::apps
