// The printer and the twin read G-code with code that shares nothing. Random programs of the whole
// dialect, read by both: after every line they must take the machine to be at the same place, and
// to have pushed the same filament. A mistake in either shows, unless both made it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "../../unit/gcode/recorder.h"
#include "random_gcode.h"
#include "tests/unit/twin/text_source.h"
#include "twin/asked_path.h"

namespace qduino::printer::gcode::two_readers_test {
namespace {

/// `dialect`: in each of them programs mean something else.
MachineConfig large_machine(std::optional<Dialect> dialect) {
    MachineConfig config;
    config.dialect = dialect;
    for (const Axis axis : kToolAxes) {
        config.axes[axis].minimum = -100000_mm;
        config.axes[axis].maximum = 100000_mm;
        config.axes[axis].home_position = Millimetres{axis == Axis::y ? -12.5 : 3};
    }
    config.macros.push_back({"MOVE_BY", "G91\nG1 X{X=1} E{E=0.5}\nG90\nM83"});
    return config;
}

twin::Machine same_machine(const MachineConfig& config) {
    twin::Machine machine;
    for (const Axis axis : kToolAxes)
        machine.axes[static_cast<std::size_t>(axis)].home_mm = config.axes[axis].home_position.value();
    if (config.dialect) machine.flavour = static_cast<twin::Flavour>(*config.dialect);
    for (const Macro& macro : config.macros)
        machine.macros.push_back({std::string{macro.name.view()}, std::string{macro.text.view()}});
    return machine;
}

/// As generators write it: now and then with an exponent.
std::string random_number(RandomGcode& random, double low, double high, int decimals) {
    std::string number = random.number(low, high, decimals);
    if (random.chance(0.1) && number.find_first_of("123456789") != std::string::npos && number.back() != '.')
        number += random.chance(0.5) ? "e-05" : random.chance(0.5) ? "E-1" : "e+00";
    return number;
}

std::string random_words(RandomGcode& random, bool arc) {
    std::string line;
    // `( … )` is a blank, whatever is in it.
    if (random.chance(0.05)) line += random.chance(0.5) ? " (a; X5 E9)" : "(G28)";
    for (const char axis : {'X', 'Y', 'Z'})
        if (random.chance(axis == 'Z' ? 0.2 : 0.6))
            line += std::string(" ") + axis + random_number(random, -60, 60, 3);
    if (random.chance(0.5)) line += " E" + random_number(random, -8, 20, 4);
    if (arc) line += " R" + random.number(400, 900, 1);
    if (random.chance(0.1)) line += " F" + random.number(300, 9000, 0);
    return line;
}

/// Names that agree at their beginnings.
std::string random_name(RandomGcode& random) {
    static const std::string kLong(70, 'b');
    static const std::string kNames[]{"b",       "B",       "b 1",       "\"b 1\"",
                                      "'b's 1'", "'b's 2'", kLong + "1", kLong + "2"};
    return kNames[random.below(std::size(kNames))];
}

std::string random_label(RandomGcode& random) {
    return (random.chance(0.3) ? "M486 C S" : "M486 S") +
           std::to_string(static_cast<int>(random.below(4)) - 1) +
           (random.chance(0.3)   ? " ACup P2 U1"
            : random.chance(0.3) ? " U1"
                                 : "");
}

/// What is kept, and what is forgotten.
std::string random_state(RandomGcode& random) {
    if (random.chance(0.3)) return random.chance(0.5) ? "SAVE_GCODE_STATE" : "SAVE_GCODE_STATE NAME=a";
    if (random.chance(0.4))
        return std::string("RESTORE_GCODE_STATE") + (random.chance(0.5) ? "" : " NAME=a") +
               (random.chance(0.3) ? " MOVE=1 MOVE_SPEED=30" : "");
    if (random.chance(0.5)) return random.chance(0.5) ? "M84 X" : random.chance(0.7) ? "M18 E" : "M84";
    return random.chance(0.7) ? "G28 O" : "G28 O X";
}

/// `objects`: hardly anything but labels of objects, filament and a move now and then.
std::string random_line(RandomGcode& random, bool objects) {
    switch (objects ? 19 + random.below(8) : random.below(37)) {
        case 0:
            return random.chance(0.8) ? "G90" : "G91";
        case 1:
            return random.chance(0.5) ? "M82" : "M83";
        case 2:
            return random.chance(0.15) ? "G20" : "G21";
        case 3:
            return random.chance(0.5) ? "G92 E0" : "G92 X" + random.number(-20, 20, 2) + " Z";
        case 4:
            return "M221 S" + random.number(60, 140, 0) + (random.chance(0.2) ? " D1" : "");
        case 5:
            return random.chance(0.5) ? "M200 D" + random.number(1.5, 3, 2) : "M200 D0";
        case 6:
            return "M92 E" + random.number(90, 110, 2) + (random.chance(0.2) ? " T1" : "");
        case 7:
            return "M207 S" + random.number(0, 5, 2) +
                   (random.chance(0.5) ? " Z" + random.number(0, 2, 2) : "");
        case 8:
            return "M208 S" + random.number(-0.2, 0.5, 2);
        case 9:
        case 10:
            return "G10";
        case 11:
        case 12:
            return "G11";
        case 13:
            return "M206 Y" + random.number(-5, 5, 2);
        case 14:
            return "SET_GCODE_OFFSET Z_ADJUST=" + random.number(-0.5, 0.5, 2) +
                   (random.chance(0.5) ? " MOVE=1" : " E=" + random.number(-1, 1, 2));
        case 15:
            return random.chance(0.3) ? "G28" : random.chance(0.5) ? "G28 Z U0" : "G28 U0";
        case 16:
            return "G" + std::to_string(17 + random.below(3));
        case 17:
            return "G92.1";
        case 18:
            return "MOVE_BY X=" + random.number(-5, 5, 2) + (random.chance(0.5) ? " e=2" : "");
        case 19:
            return random_label(random);
        case 20:
            return std::string(random.chance(0.5) ? "M486 P" : "M486 U") + std::to_string(random.below(3));
        case 21:
            return std::string(random.chance(0.5)   ? "EXCLUDE_OBJECT_START NAME="
                               : random.chance(0.3) ? "START_CURRENT_OBJECT NAME="
                                                    : "EXCLUDE_OBJECT NAME=") +
                   random_name(random);
        case 22:
            return random.chance(0.8) ? "EXCLUDE_OBJECT_END" : "END_CURRENT_OBJECT";
        case 23:
            return "G1 E" + random.number(-8, 20, 4);
        case 24:
            // Sideways does not go either of them.
            return random.chance(0.3) ? "G1" : "G1 Z" + random.number(-60, 60, 3);
        case 25:
        case 26:
            return (random.chance(0.5) ? "G2" : "G3") + random_words(random, true);
        case 27:
            return "G5 I" + random.number(-9, 9, 2) + " J" + random.number(-9, 9, 2) + " P" +
                   random.number(-9, 9, 2) + " Q" + random.number(-9, 9, 2) + random_words(random, false);
        case 28:
        case 29:
        case 30:
            return random_state(random);
        default:
            return "G1" + random_words(random, false);
    }
}

/// Where the last move of `recorder` leads; the machine's home before the first.
struct Place {
    double mm[4] = {};
    double pushed_mm = 0;
};

class Follower {
  public:
    explicit Follower(const MachineConfig& config) {
        for (const Axis axis : kToolAxes)
            at_.mm[static_cast<int>(axis)] = config.axes[axis].home_position.value();
    }
    const Place& follow(const std::vector<Move>& moves) {
        for (; done_ < moves.size(); ++done_) {
            const Move& move = moves[done_];
            for (int axis = 0; axis < 3; ++axis)
                at_.mm[axis] = move.to[static_cast<std::size_t>(axis)].value();
            const double pushed = (move.to[Axis::e] - move.from[Axis::e]).value();
            at_.mm[3] += pushed;
            at_.pushed_mm += std::max(pushed, 0.0);
        }
        return at_;
    }
    /// What the recorder has noted: `home XY`.
    void home(const std::string& noted, const MachineConfig& config) {
        if (noted.rfind("home ", 0) != 0) return;
        for (const Axis axis : kToolAxes)
            if (noted.find(kAxisLetter[axis]) != std::string::npos)
                at_.mm[static_cast<int>(axis)] = config.axes[axis].home_position.value();
    }

  private:
    Place at_;
    std::size_t done_ = 0;
};

/// The twin's place after the first `lines` lines.
class TwinReader {
  public:
    TwinReader(const std::string& text, const MachineConfig& config)
        : source_(text), path_(source_, start(config), same_machine(config)), next_(path_.next()) {}

    void pass_line(std::uint64_t line) {
        for (; next_.kind != twin::AskedItem::Kind::end && next_.line <= line; next_ = path_.next()) {
            if (next_.kind == twin::AskedItem::Kind::move) pushed_mm += std::max(next_.to[3] - at[3], 0.0);
            at = next_.to;
        }
    }
    twin::Position at{};
    double pushed_mm = 0;

  private:
    twin::Position start(const MachineConfig& config) {
        for (const Axis axis : kToolAxes)
            at[static_cast<std::size_t>(axis)] = config.axes[axis].home_position.value();
        return at;
    }
    twin::TextSource source_;
    twin::AskedPath path_;
    twin::AskedItem next_;
};

TEST(TwoReaders, AgreeAfterEveryLine) {
    std::size_t moves = 0;
    for (std::uint64_t seed = 1; seed <= 400; ++seed) {
        RandomGcode random{seed};
        // One that is said after the fact would be an error.
        const MachineConfig config =
            large_machine(seed % 3 == 0 ? std::optional{Dialect::marlin} : std::nullopt);
        const std::string sign = seed % 3 == 0   ? ";"
                                 : seed % 3 == 1 ? "; gcode_flavor = klipper"
                                                 : "M572 D0 S0";
        std::vector<std::string> lines{sign, "G28", "G1 F3000"};
        std::string text = sign + "\nG28\nG1 F3000\n";
        Bench bench{config};
        (void)bench.run(text);
        Follower printer{config};
        // Only lines that the printer takes: what it refuses is not asked of anybody.
        for (int i = 0; i < 60; ++i) {
            const std::string line = random_line(random, seed % 4 == 0);
            const auto log = bench.run(line + "\n");
            if (!log.empty() && log.back().rfind("error", 0) == 0) continue;
            lines.push_back(line);
            text += line + "\n";
        }
        Bench again{config};
        TwinReader reader{text, config};
        for (std::size_t i = 0; i < lines.size(); ++i) {
            const auto log = again.run(lines[i] + "\n");
            // What the end asks for stands behind the last line.
            const Result<void> ended = i + 1 == lines.size() ? again.interpreter.finish() : Result<void>{};
            ASSERT_TRUE(ended.ok());
            // What a homing line asks of the filament, it asks before the head goes.
            const Place& place = printer.follow(again.recorder.moves);
            for (const std::string& noted : log) printer.home(noted, config);
            reader.pass_line(i + 1);
            for (int axis = 0; axis < 4; ++axis) {
                ASSERT_NEAR(place.mm[axis], reader.at[static_cast<std::size_t>(axis)], 1e-7)
                    << "seed " << seed << ", line " << i + 1 << ": " << lines[i] << ", "
                    << "XYZE"[axis] << "\n"
                    << text;
            }
            ASSERT_NEAR(place.pushed_mm, reader.pushed_mm, 1e-6) << "seed " << seed << ", " << lines[i];
        }
        moves += again.recorder.moves.size();
    }
    EXPECT_GT(moves, 20'000U);
}

}  // namespace
}  // namespace qduino::printer::gcode::two_readers_test
