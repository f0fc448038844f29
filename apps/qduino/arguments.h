// The command line of `qduino`: its options, and the values given.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace qduino::apps {

enum class Command { make_new, build, run, sim, check, trace, doctor, restore, completion };

struct Arguments {
    Command command{};
    std::string sketch = ".";  ///< folder or .ino
    bool verbose = false;
    std::string name;    ///< new
    std::string only;    ///< build: "sim", "linux" or empty
    std::string output;  ///< build: folder; trace: file
    std::optional<double> length_s;
    std::optional<double> speed;
    std::optional<int> cores;
    std::optional<std::uint64_t> seed;
    std::string board, pins, report;
    bool isolate = false, best_effort = false;
    bool on_linux = false;  ///< trace
    bool json = false;
    std::string certificate;     ///< check: file
    std::string settings_state;  ///< restore
    std::string shell;           ///< completion
};

/// The parser, which fills in `arguments`; that outlives it.
[[nodiscard]] std::unique_ptr<CLI::App> make_parser(Arguments& arguments);

/// The completion script of `parser` for a shell, "bash", "zsh" or "fish"; anything else gives an
/// empty text.
[[nodiscard]] std::string completion_script(const CLI::App& parser, const std::string& shell);

/// Carries out `arguments.command`. Returns the exit status: 0, 1 on failure, 2 when admission
/// refuses the sketch. `parser` is for `completion`.
int run_command(const Arguments& arguments, const CLI::App& parser);

}  // namespace qduino::apps
