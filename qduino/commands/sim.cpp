// qduino sim: a sketch in the simulator.
#include <optional>

#include "base/text.h"
#include "qduino/built_sketch.h"
#include "qduino/command.h"

namespace qduino::apps {
namespace {

class Sim final : public Command {
    void declare(CLI::App& app) override {
        sketch_.declare(app);
        length_.declare(app, "Virtual seconds (default 10)");
        add_option(app, "--speed", speed_, "Virtual seconds per second (default: all)", "K")
            ->check(positive_number());
        simulated_.declare(app);
        picture_.declare(app, "Draw loops, pins, and R against T: .svg");
        shown_.declare(app);
        report_.declare(app);
    }

    Result<int> run() override {
        return become_simulation(sketch_, simulated_.board, picture_, [this](const Sketch&) {
            Words words;
            length_.add_to(words);
            if (speed_) add_words(words, "--speed", Shortest{*speed_});
            simulated_.add_to(words);
            picture_.add_to(words);
            shown_.add_to(words);
            report_.add_to(words);
            return words;
        });
    }

    SketchOptions sketch_;
    LengthOption length_;
    std::optional<double> speed_;
    SimulatedOptions simulated_;
    PictureOptions picture_;
    ShownOptions shown_;
    ReportOption report_;
};

const Listed<Sim> sim_listed{{Place::sim, "sim", "Run a sketch in the simulator",
                              "Virtual time: the same seed gives the same run, to the nanosecond. Ends\n"
                              "with 2 when admission refuses the sketch.\n"
                              "Example: qduino sim blinker --for 60 --picture blinker.svg"}};

}  // namespace
}  // namespace qduino::apps
