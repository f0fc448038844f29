// qduino check: would a sketch be admitted?
#include <filesystem>
#include <string>

#include "qduino/built_sketch.h"
#include "qduino/command.h"

namespace qduino::apps {
namespace {

/// The files of a sketch, a line each.
std::string lines_of(const Sketch& sketch) {
    std::string lines;
    for (const std::filesystem::path& tab : sketch.tabs) lines += tab.string() + '\n';
    for (const std::filesystem::path& source : sketch.sources) lines += source.string() + '\n';
    return lines;
}

class Check final : public Command {
    void declare(CLI::App& app) override {
        sketch_.declare(app);
        app.add_flag("--json", json_, "As JSON (docs/qduino.md lists the keys)");
        add_option(app, "--certificate", certificate_,
                   "Write what was assumed and derived, for tools/check_certificate.py", "FILE");
        simulated_.declare(app);
        picture_.declare(app, "Draw the worst case, and R against T: .svg");
        app.add_flag("--plain", plain_, "No strip of blocks: for a screen reader");
    }

    Result<int> run() override {
        return become_simulation(sketch_, simulated_.board, picture_, [this](const Sketch& sketch) {
            Words words{"--check"};
            simulated_.add_to(words);
            picture_.add_to(words);
            if (plain_) words.emplace_back("--plain");
            if (json_) words.emplace_back("--json");
            if (!certificate_.empty())
                append(words, {"--certificate", certificate_, "--sources", lines_of(sketch)});
            return words;
        });
    }

    SketchOptions sketch_;
    bool json_ = false;
    std::string certificate_;  // a file
    SimulatedOptions simulated_;
    PictureOptions picture_;
    bool plain_ = false;
};

const Listed<Check> check_listed{
    {Place::check, "check", "Would a sketch be admitted?",
     "No loop runs. setup() runs, with nothing wired, only if the sketch has calls\n"
     "that declare I/O VCPUs or critical sections, or route interrupts. Counts the\n"
     "overheads that the board file names.\n"
     "Ends with 0 when admitted, 2 when refused: then it names the loop, its R and\n"
     "T, each one's share, and the smallest change that would be admitted.\n"
     "Example: qduino check blinker.ino --cores 1 --json"}};

}  // namespace
}  // namespace qduino::apps
