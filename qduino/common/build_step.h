// One step of a build (a run of a compiler or a linker), and whether it has to run at all.
//
//   output      made by the step; its time is set to the beginning of the step, so that a file that
//               was saved during the step counts as newer
//   output.cmd  the command that made it: a different command makes it again
//   output.log  the compiler's words: repeated as long as the output stands, so that no warning is
//               lost
//   depfile     the files that it read besides its inputs (gcc -MD)
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace qduino::apps {

struct BuildStep {
    std::string title;  ///< "Compiling blink.ino"
    std::vector<std::string> command;
    std::vector<std::filesystem::path> inputs;
    std::filesystem::path output;
    std::filesystem::path depfile;  ///< empty: none
    /// Further words of the command, which may differ from run to run without making it again.
    std::vector<std::string> unrecorded = {};
    /// Others go on when it says no, and what its program said is kept for later.
    bool may_fail = false;
};

/// True when the output stands, was made by the same command, and nothing that went into it has
/// changed since.
[[nodiscard]] bool is_up_to_date(const BuildStep& step);

/// The files that a depfile names (make's syntax: "a.o: a.cpp b\ c.h \"), without the target.
[[nodiscard]] std::vector<std::filesystem::path> dependencies_in(std::string_view depfile);

/// The text of a small file; empty where there is none.
[[nodiscard]] std::string text_of(const std::filesystem::path& path);

/// `text` without the escape sequences by which compilers colour it.
[[nodiscard]] std::string without_colours(std::string_view text);

/// The result of some steps.
struct StepsDone {
    int made = 0;         ///< that had to be run
    bool failed = false;  ///< one could not be; what its program said has been printed
};

/// Runs one step, silently: what its program says is in output.log. False: it said no. Error: it
/// could not be started, a file could not be written. May be called from several threads.
[[nodiscard]] Result<bool> run_step(const BuildStep& step);

/// Runs those of `steps` that are not up to date, as many at once as there are cores. Progress and
/// the compilers' words go to stderr. Error: a program could not be started, a file could not be
/// written.
Result<StepsDone> run_steps(const std::vector<BuildStep>& steps, bool verbose);

}  // namespace qduino::apps
