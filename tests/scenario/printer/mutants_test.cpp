// Parts that are almost right. The whole printer builds a file in which one thing is spoiled, and
// the twin compares with the file as it should be: on each kinematics every such part is another
// one, and the unspoiled part is none.
//
//   ring        a circle as chords that leave it by 0.03 mm
//   helix       the same, while Z goes up
//   vase        a wall without layers, of straight lines: every other corner is left out, 0.03 mm
//   retraction  is not made, before a travel
//   flow        1 % more filament
//   scale       the printer's steps/mm are 0.1 % off
//
// One late step of 200 us leaves the part as it is, but for its height there:
// tests/unit/twin/height_map_test.cpp, and printer_sim_test.py on a computer that is late.
#include <gtest/gtest.h>

#include <numbers>

#include "config/machine_file.h"
#include "tests/scenario/printer/printer_bench.h"

namespace qduino::tests::mutants_test {
namespace {

using link::JobOutcome;
using printer::Axis;
using printer::KinematicsType;
using printer::MachineConfig;

enum class Spoiled { nothing, ring, helix, vase, retraction, flow, scale };

constexpr double kPi = std::numbers::pi;
constexpr double kRadius_mm = 10;
constexpr double kBeside_mm = 0.03;

MachineConfig machine_of(KinematicsType type) {
    const std::string delta =
        "[kinematics]\ntype = \"delta\"\ndelta_radius_mm = 105\narm_length_mm = 215\nbed_radius_mm = 90\n";
    std::string text = type == KinematicsType::delta    ? delta
                       : type == KinematicsType::corexy ? "[kinematics]\ntype = \"corexy\"\n"
                                                        : "";
    for (const char* axis : {"x", "y", "z"}) {
        if (type != KinematicsType::delta) continue;
        text += qduino::text<std::string>("[axes.", axis, "]\nsteps_per_mm = 80\nmax_speed_mm_s = 100\n",
                                          "max_acceleration_mm_s2 = 2000\ninstantaneous_speed_mm_s = 20\n",
                                          "home_speed_mm_s = 40\nhome_retreat_mm = 3\n");
    }
    const auto parsed = apps::parse_machine(text, "mutants.toml");
    EXPECT_TRUE(parsed) << parsed.error().message.view();
    MachineConfig machine = *parsed;
    machine.hot_end.model.power_w = 200;  // hot in seconds
    machine.reversal_gap = {};
    return machine;
}

/// Lines of a job, around a middle.
class Lines {
  public:
    explicit Lines(double middle_mm) : middle_mm_(middle_mm) {}

    void add(std::string_view line) { text_.append(line).push_back('\n'); }
    /// To the place at `angle` of the circle, Z and filament with it.
    void turn_to(double angle, double z_mm, double e_mm) {
        write(text_, "G1 X", Fixed{middle_mm_ + kRadius_mm * std::cos(angle), 5}, " Y",
              Fixed{middle_mm_ + kRadius_mm * std::sin(angle), 5}, " Z", Fixed{z_mm, 5}, " E", Fixed{e_mm, 5},
              '\n');
    }
    /// Once around from angle 0, from `z_mm` to `top_mm`: an arc, or its chords.
    void turn(double z_mm, double top_mm, bool as_chords) {
        constexpr double kFilament_mm = 2;
        if (!as_chords) {
            write(text_, "G3 X", Fixed{middle_mm_ + kRadius_mm, 5}, " Y", Fixed{middle_mm_, 5}, " Z",
                  Fixed{top_mm, 5}, " I-", Fixed{kRadius_mm, 5}, " J0 E", Fixed{kFilament_mm, 5}, '\n');
            return;
        }
        const int chords = static_cast<int>(std::ceil(kPi / std::acos(1 - kBeside_mm / kRadius_mm)));
        for (int i = 1; i <= chords; ++i)
            turn_to(2 * kPi * i / chords, z_mm + (top_mm - z_mm) * i / chords, kFilament_mm / chords);
    }
    /// Twice around, up by 0.4 mm, in so short lines that each second corner is kBeside_mm away
    /// from the line past it.
    void vase(double z_mm, int every) {
        const int corners = 2 * static_cast<int>(kPi / std::acos(1 - kBeside_mm / kRadius_mm));
        for (int i = every; i <= 2 * corners; i += every)
            turn_to(2 * kPi * i / corners, z_mm + 0.4 * i / (2 * corners), 0.02 * every);
    }
    [[nodiscard]] std::string take() { return std::move(text_); }

  private:
    double middle_mm_;
    std::string text_;
};

std::string part(KinematicsType type, Spoiled spoiled) {
    Lines lines{type == KinematicsType::delta ? 0.0 : 75.0};
    const bool has_retraction = spoiled != Spoiled::retraction;
    for (const char* line : {"M104 S200", "G28", "M109 S200", "M83", "G1 Z0.3 F600", "G1 F3000"})
        lines.add(line);
    if (spoiled == Spoiled::flow) lines.add("M221 S101");
    lines.turn_to(0, 0.3, 0);
    lines.add("G1 F1800");
    lines.turn(0.3, 0.3, spoiled == Spoiled::ring);
    lines.turn(0.3, 0.8, spoiled == Spoiled::helix);
    lines.vase(0.8, spoiled == Spoiled::vase ? 2 : 1);
    if (has_retraction) lines.add("G1 E-0.8 F2400");
    lines.turn_to(kPi, 1.2, 0);
    if (has_retraction) lines.add("G1 E0.8 F2400");
    lines.turn_to(1.5 * kPi, 1.2, 0.6);
    return lines.take();
}

const char* name_of(KinematicsType type) {
    if (type == KinematicsType::cartesian) return "Cartesian";
    return type == KinematicsType::corexy ? "CoreXy" : "Delta";
}

class Mutants : public testing::TestWithParam<KinematicsType> {
  protected:
    static twin::Report report_of(Spoiled spoiled) {
        const MachineConfig right = machine_of(GetParam());
        MachineConfig believed = right;
        if (spoiled == Spoiled::scale)
            for (const Axis axis : {Axis::x, Axis::y}) believed.axes[axis].steps_per_mm *= 1.001;
        PrinterBench bench{believed, apps::twin_machine(right)};
        EXPECT_TRUE(bench.begin());
        bench.job(part(GetParam(), spoiled));
        bench.watch(part(GetParam(), Spoiled::nothing));
        EXPECT_TRUE(bench.finish_job());
        EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
        return bench.report();
    }
    /// The twin must report differences, and one of them must say `words`.
    static void expect_different(Spoiled spoiled, std::string_view words) {
        const twin::Report report = report_of(spoiled);
        EXPECT_FALSE(report.matches);
        std::string all;
        for (const std::string& difference : report.differences) all += difference + "\n";
        EXPECT_NE(all.find(words), std::string::npos) << all;
    }
};

TEST_P(Mutants, TheUnspoiledPartMatches) {
    const twin::Report report = report_of(Spoiled::nothing);
    EXPECT_TRUE(report.matches) << (report.differences.empty() ? "" : report.differences[0]);
}
TEST_P(Mutants, AChordBesideTheArc) { expect_different(Spoiled::ring, "left the asked curve"); }
TEST_P(Mutants, AChordBesideAHelix) { expect_different(Spoiled::helix, "left the asked curve"); }
TEST_P(Mutants, ACoarseVase) { expect_different(Spoiled::vase, "left the asked path"); }
TEST_P(Mutants, ALostRetraction) { expect_different(Spoiled::retraction, "E left the asked path"); }
TEST_P(Mutants, OnePercentOfFlow) { expect_different(Spoiled::flow, "of filament were pushed where"); }
TEST_P(Mutants, WrongStepsPerMillimetre) { expect_different(Spoiled::scale, "left the asked curve"); }

INSTANTIATE_TEST_SUITE_P(On, Mutants,
                         testing::Values(KinematicsType::cartesian, KinematicsType::corexy,
                                         KinematicsType::delta),
                         [](const auto& each) { return name_of(each.param); });

}  // namespace
}  // namespace qduino::tests::mutants_test
