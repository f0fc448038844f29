#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "../../unit/gcode/recorder.h"
#include "printer/preflight/preflight.h"
#include "random_gcode.h"

namespace qduino::printer::gcode::meaning_property_test {
namespace {

/// Finite, inside the bounds, each beginning where the one before ended.
::testing::AssertionResult sane(const std::vector<Move>& moves, const MachineConfig& config) {
    for (std::size_t i = 0; i < moves.size(); ++i) {
        const Move& move = moves[i];
        const double speed = move.feedrate.value();
        if (!(speed > 0) || !std::isfinite(speed)) return ::testing::AssertionFailure() << "speed " << speed;
        if (move.from == move.to) return ::testing::AssertionFailure() << "move " << i << " goes nowhere";
        for (const Axis axis : kAllAxes) {
            if (!std::isfinite(move.to[axis].value())) return ::testing::AssertionFailure() << "not finite";
        }
        for (const Axis axis : kToolAxes) {
            const AxisConfig& limits = config.axes[axis];
            const Millimetres to = move.to[axis];
            if (to < limits.minimum || to > limits.maximum) {
                return ::testing::AssertionFailure() << "move " << i << " leaves the bounds: " << to.value();
            }
        }
    }
    return ::testing::AssertionSuccess();
}

TEST(MeaningProperty, RandomBytesMoveNothing) {
    // Uniform bytes: a command is hardly ever among them, a malformed line always is.
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        RandomGcode random{seed};
        std::string bytes;
        for (int i = 0; i < 4000; ++i) bytes += static_cast<char>(random.below(256));
        Bench bench;
        (void)bench.run(bytes);
        ASSERT_TRUE(bench.recorder.moves.empty()) << "seed " << seed;
    }
}

TEST(MeaningProperty, WhateverIsReadTheMovesAreSane) {
    std::size_t moves = 0;
    for (std::uint64_t seed = 0; seed < 400; ++seed) {
        RandomGcode random{seed};
        Bench bench;
        (void)bench.run(random.noise(4000));
        ASSERT_TRUE(sane(bench.recorder.moves, MachineConfig{})) << "seed " << seed;
        moves += bench.recorder.moves.size();
    }
    EXPECT_GT(moves, 1000U) << "the noise must be close enough to G-code to move something";
}

/// Commands that change modes and move, some of them beyond the bounds.
struct Program {
    std::vector<std::string> lines;
};

Program random_program(RandomGcode& random, int length) {
    Program program{{"G28"}};
    for (int i = 0; i < length; ++i) {
        std::string line;
        switch (random.below(12)) {
            case 0:
                line = "G90";
                break;
            case 1:
                line = "G91";
                break;
            case 2:
                line = random.chance(0.5) ? "M82" : "M83";
                break;
            case 3:
                line = random.chance(0.3) ? "G20" : "G21";
                break;
            case 4:
                line = "G92 E" + random.number(-10, 10, 3);
                break;
            case 5:
                line = "G92 X" + random.number(-20, 20, 3) + " Z" + random.number(0, 5, 3);
                break;
            case 6:
                line = "M221 S" + random.number(50, 150, 0);
                break;
            default:
                line = "G1";
                if (random.chance(0.6)) line += " X" + random.number(-30, 160, 3);
                if (random.chance(0.6)) line += " Y" + random.number(-30, 160, 3);
                if (random.chance(0.2)) line += " Z" + random.number(-3, 20, 3);
                if (random.chance(0.5)) line += " E" + random.number(-20, 40, 5);
                if (random.chance(0.3)) line += " F" + random.number(60, 9000, 0);
        }
        program.lines.push_back(line);
    }
    return program;
}

/// The oracle: the modal rules written down once more, on plain numbers, with a parser of `sscanf`.
class NaiveInterpreter {
  public:
    double machine[4] = {0, 0, 0, 0};

    void run(const std::string& line) {
        if (line == "G90") relative = relative_e = false;
        if (line == "G91") relative = relative_e = true;
        if (line == "M82") relative_e = false;
        if (line == "M83") relative_e = true;
        if (line == "G20") unit = 25.4;
        if (line == "G21") unit = 1;
        double value = 0;
        if (std::sscanf(line.c_str(), "M221 S%lf", &value) == 1) flow = value / 100;
        if (line.rfind("G92", 0) == 0) set_position(line);
        if (line.rfind("G1", 0) == 0) move(line);
    }

  private:
    static bool find(const std::string& line, char letter, double& value) {
        const std::size_t at = line.find(std::string(" ") + letter);
        return at != std::string::npos && std::sscanf(line.c_str() + at + 2, "%lf", &value) == 1;
    }
    void set_position(const std::string& line) {
        double value = 0;
        for (int i = 0; i < 3; ++i) {
            if (find(line, "XYZE"[i], value)) offset[i] = machine[i] - value * unit;
        }
        if (find(line, 'E', value)) programmed_e = value * unit;
    }
    void move(const std::string& line) {
        double to[4] = {machine[0], machine[1], machine[2], machine[3]};
        double value = 0;
        for (int i = 0; i < 3; ++i) {
            if (!find(line, "XYZE"[i], value)) continue;
            to[i] = value * unit + (relative ? machine[i] : offset[i]);
            if (to[i] != machine[i] && (to[i] < -0.001 || to[i] > 150.001)) return;
            to[i] = std::fmin(std::fmax(to[i], 0), 150);
        }
        double next_e = programmed_e;
        if (find(line, 'E', value)) next_e = value * unit + (relative_e ? programmed_e : 0);
        to[3] += (next_e - programmed_e) * flow;
        if (std::fabs(to[3] - machine[3]) > 1000) return;
        programmed_e = next_e;
        for (int i = 0; i < 4; ++i) machine[i] = to[i];
    }
    bool relative = false, relative_e = false;
    double unit = 1, flow = 1, offset[3] = {0, 0, 0}, programmed_e = 0;
};

TEST(MeaningProperty, PositionsAreThoseOfTheNaiveInterpreter) {
    for (std::uint64_t seed = 0; seed < 300; ++seed) {
        RandomGcode random{seed};
        Bench bench;
        NaiveInterpreter oracle;
        for (const std::string& line : random_program(random, 200).lines) {
            (void)bench.run(line + "\n");
            oracle.run(line);
            for (const Axis axis : kAllAxes) {
                ASSERT_NEAR(bench.interpreter.state().machine[axis].value(),
                            oracle.machine[static_cast<int>(axis)], 1e-9)
                    << "seed " << seed << " after " << line;
            }
        }
    }
}

TEST(MeaningProperty, AFailingLineMightAsWellNotBeThere) {
    const char* const kBad[] = {
        "G1 X90000 F1", "G1 X10 Y",  "G92 X5 Q",         "G91 G1 X5", "G1 X5 X6",  "M104 S999",
        "G2 X5 I1 R5",  "G1 X1.2.3", "G20 G21",          "M220 S0",   "G10 P1 S9", "G999",
        "G1 E5000 F60", "M207 S-1",  "G3 X90000 R60000", "G4 S-1 P5", "T7",        "G1 F-1"};
    // A line that fails has said all the same whose dialect it is of.
    MachineConfig machine;
    machine.dialect = Dialect::marlin;
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        RandomGcode random{seed};
        Bench clean{machine};
        Bench disturbed{machine};
        for (const std::string& line : random_program(random, 100).lines) {
            (void)clean.run(line + "\n");
            (void)disturbed.run(line + "\n");
            const std::string bad = random.pick(kBad);
            const auto log = disturbed.run(bad + "\n");
            ASSERT_EQ(log.size(), 1U) << bad;
            ASSERT_EQ(log[0].rfind("error", 0), 0U) << bad << ": " << log[0];
        }
        ASSERT_EQ(clean.recorder.moves.size(), disturbed.recorder.moves.size()) << "seed " << seed;
        for (std::size_t i = 0; i < clean.recorder.moves.size(); ++i) {
            ASSERT_EQ(clean.recorder.moves[i].to, disturbed.recorder.moves[i].to) << "seed " << seed;
            ASSERT_EQ(clean.recorder.moves[i].feedrate, disturbed.recorder.moves[i].feedrate)
                << "seed " << seed;
        }
    }
}

TEST(MeaningProperty, MovesJoinUnlessHomingStandsBetween) {
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        RandomGcode random{seed};
        Bench bench;
        for (const std::string& line : random_program(random, 200).lines) (void)bench.run(line + "\n");
        const auto& moves = bench.recorder.moves;
        for (std::size_t i = 1; i < moves.size(); ++i)
            ASSERT_EQ(moves[i].from, moves[i - 1].to) << "seed " << seed;
        if (!moves.empty()) {
            ASSERT_EQ(bench.interpreter.state().machine, moves.back().to);
        }
    }
}

TEST(MeaningProperty, PreflightDoesNotDependOnTheChunks) {
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
        RandomGcode random{seed};
        std::string job;
        for (const std::string& line : random_program(random, 300).lines) job += line + "\n";
        const auto read = [](const std::vector<std::string>& pieces) {
            preflight::Preflight preflight{MachineConfig{}};
            for (const std::string& piece : pieces) preflight.feed({piece.data(), piece.size()});
            return preflight.finish();
        };
        const preflight::Facts whole = read({job});
        const preflight::Facts cut = read(random.cut(job));
        ASSERT_EQ(cut.moves, whole.moves) << "seed " << seed;
        ASSERT_EQ(cut.errors_count, whole.errors_count) << "seed " << seed;
        ASSERT_EQ(cut.filament, whole.filament) << "seed " << seed;
        ASSERT_EQ(cut.bytes, whole.bytes);
        ASSERT_EQ(cut.lines, whole.lines);
        ASSERT_EQ(cut.bounds.maximum, whole.bounds.maximum) << "seed " << seed;
    }
}

}  // namespace
}  // namespace qduino::printer::gcode::meaning_property_test
