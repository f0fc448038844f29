#include "twin/inspector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/unit/twin/naive_firmware.h"
#include "tests/unit/twin/text_source.h"
#include "twin/report.h"

namespace qduino::twin::inspector_test {
namespace {

using testing::Event;
using testing::inspect;
using testing::NaiveFirmware;

Report judged(const Findings& findings, std::uint64_t excursions_told = 0) {
    Report report;
    report.findings = findings;
    report.excursions_told = excursions_told;
    judge(report, Machine{});
    return report;
}

std::string explain(const Report& report) { return to_json(report); }

double machine_steps(int axis) { return Machine{}.axes[static_cast<std::size_t>(axis)].steps_per_mm; }

struct Built {
    Machine machine{};
    NaiveFirmware firmware{machine};
    [[nodiscard]] Report report(const std::string& gcode) const {
        return judged(inspect(machine, gcode, firmware.events, firmware.start()));
    }
};

TEST(Inspector, AStraightLineMatches) {
    Built built;
    built.firmware.move_to({10, 0, 0, 0});
    const Report report = built.report("G1 X10 F3000\n");
    EXPECT_TRUE(report.matches) << explain(report);
    EXPECT_EQ(report.findings.axes[0].steps, 800u);
    EXPECT_LE(report.findings.axes[0].path_deviation_mm_max, 0.51 / 80);
    EXPECT_DOUBLE_EQ(report.findings.axes[0].final_built_mm, 10.0);
}

TEST(Inspector, BetweenTwoStepsBothAreRightAndNoOther) {
    for (const int steps : {799, 800, 801, 802}) {
        Built built;
        built.firmware.move_to({steps / machine_steps(0), 0, 0, 0});
        const Report report = built.report("G1 X10.00625 F3000\n");  // 800.5
        EXPECT_EQ(report.matches, steps == 800 || steps == 801) << steps << explain(report);
    }
}

/// A machine with other scales than the reference machine's.
Machine scaled(double x, double y, double z, double e) {
    Machine machine;
    const double steps[]{x, y, z, e};
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) machine.axes[axis].steps_per_mm = steps[axis];
    return machine;
}

/// G-code of circles and arcs that touch lines, cusps and each other, built with chords `chord_mm`
/// beside the true curve.
Report built_arcs(const Machine& machine, double chord_mm) {
    NaiveFirmware firmware(machine);
    constexpr double kPi = std::numbers::pi;
    std::string gcode = "G1 X20 Y20\nG1 X40 Y20 E1\n";
    firmware.move_to({20, 20, 0, 0});
    firmware.move_to({40, 20, 0, 1});
    gcode += "G3 X60 Y40 I0 J20 E2.5\n";  // a quarter, tangent to the line before it
    firmware.arc_to({60, 40, 0, 2.5}, 40, 40, kPi / 2, chord_mm);
    gcode += "G2 X60 Y40 I-10 J0 E5\n";  // a whole circle that begins with a cusp
    firmware.arc_to({60, 40, 0, 5}, 50, 40, -2 * kPi, chord_mm);
    gcode += "G2 X50 Y30 I-10 J0 E3 Z1\n";  // a helix, drawing filament back
    firmware.arc_to({50, 30, 1, 3}, 50, 40, -kPi / 2, chord_mm);
    gcode += "G1 Z0.5\nG1 X48.7 Y30.3 E3.2\n";
    firmware.move_to({50, 30, 0.5, 3});
    firmware.move_to({48.7, 30.3, 0.5, 3.2});
    gcode += "G3 X48.7 Y30.3 I0.02 J0 E3.3\nG1 X20\n";  // smaller than a step
    firmware.arc_to({48.7, 30.3, 0.5, 3.3}, 48.72, 30.3, 2 * kPi, std::min(chord_mm, 0.005));
    firmware.move_to({20, 30.3, 0.5, 3.3});
    Report report;
    report.findings = inspect(machine, gcode, firmware.events, firmware.start());
    judge(report, machine);
    return report;
}

TEST(Inspector, ArcsAreJudgedByTheTrueCircleAtAnyScale) {
    for (const Machine& machine :
         {Machine{}, scaled(100, 100, 400, 415), scaled(26.7, 40, 800, 140.5), scaled(320, 640, 3200, 690)}) {
        for (const double chord_mm : {0.0005, 0.005}) {
            const Report report = built_arcs(machine, chord_mm);
            EXPECT_TRUE(report.matches) << machine.axes[0].steps_per_mm << " " << chord_mm << explain(report);
        }
        const Report coarse = built_arcs(machine, 0.03);
        EXPECT_FALSE(coarse.matches) << machine.axes[0].steps_per_mm << explain(coarse);
        EXPECT_NE(coarse.differences[0].find("left the asked curve"), std::string::npos) << explain(coarse);
    }
}

/// Z's steps are finer than those of X and Y, which show in it square to the helix.
TEST(Inspector, ASteepHelixIsJudgedByItsCurve) {
    for (const Machine& machine :
         {scaled(80, 80, 400, 96), scaled(20, 20, 100, 24), scaled(26.7, 40, 400, 140.5)}) {
        const double coarse_mm = machine.axes[0].steps_per_mm == 80 ? 0.03 : 0.06;
        for (const double chord_mm : {0.001, 0.005, coarse_mm}) {
            NaiveFirmware firmware(machine);
            firmware.move_to({20, 9, 0, 0});
            firmware.arc_to({20, 9, 20, 0}, 40, 9, 2 * std::numbers::pi, chord_mm);
            firmware.move_to({20, 9, 10, 0});
            firmware.arc_to({20, 9, 30, 0}, 24, 9, -2 * std::numbers::pi, chord_mm);
            Report report;
            report.findings = inspect(machine, "G1 X20 Y9\nG3 X20 Y9 Z20 I20\nG1 Z10\nG2 X20 Y9 Z30 I4\n",
                                      firmware.events, firmware.start());
            judge(report, machine);
            EXPECT_EQ(report.matches, chord_mm < 0.01) << chord_mm << explain(report);
        }
    }
}

TEST(Inspector, AWrongScaleIsADifference) {
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        Machine believed;
        believed.axes[axis].steps_per_mm *= 1.01;
        NaiveFirmware firmware(believed);
        firmware.move_to({30, 20, 3, 4});
        Report report;
        report.findings = inspect(Machine{}, "G1 X30 Y20 Z3 E4\n", firmware.events, firmware.start());
        judge(report, Machine{});
        EXPECT_FALSE(report.matches) << axis << explain(report);
    }
}

TEST(Inspector, ALostRetractionIsADifference) {
    const std::string gcode = "M207 S0.8\nG1 X10 E1\nG10\nG1 X20\nG11\nG1 X30 E2\n";
    for (const bool lost : {false, true}) {
        Built built;
        built.firmware.move_to({10, 0, 0, 1});
        if (!lost) built.firmware.move_to({10, 0, 0, 0.2});
        built.firmware.move_to({20, 0, 0, lost ? 1 : 0.2});
        built.firmware.move_to({20, 0, 0, 1});
        built.firmware.move_to({30, 0, 0, 2});
        EXPECT_EQ(built.report(gcode).matches, !lost) << explain(built.report(gcode));
    }
}

TEST(Inspector, OnePercentOfFlowIsADifference) {
    Built built;
    built.firmware.move_to({100, 0, 0, 3.3 * 1.01});
    EXPECT_FALSE(built.report("G1 X100 E3.3\n").matches);
}

TEST(Inspector, ADiagonalWithExtrusionMatches) {
    Built built;
    built.firmware.move_to({31.234, 17.891, 0.2, 1.23456});
    built.firmware.move_to({3.777, 44.01, 0.2, 3.2});
    const Report report = built.report("G1 X31.234 Y17.891 Z.2 E1.23456 F1800\nG1 X3.777 Y44.01 E3.2\n");
    EXPECT_TRUE(report.matches) << explain(report);
    EXPECT_NEAR(report.findings.filament_built_mm, 3.2, 1.0 / 96);
}

TEST(Inspector, NothingAskedAndNothingBuiltMatches) {
    Built built;
    EXPECT_TRUE(built.report("; nothing\nM104 S200\nG92 E0\n").matches);
    EXPECT_TRUE(built.report("").matches);
}

TEST(Inspector, AskedButNotBuiltIsNotCompleted) {
    Built built;
    const Report report = built.report("G1 X10\n");
    EXPECT_FALSE(report.completed);
    EXPECT_FALSE(report.matches);
    built.firmware.move_to({10, 0, 0, 0});
    EXPECT_FALSE(built.report("G1 X10\nG1 Y5\n").completed);
    EXPECT_FALSE(built.report("G1 X10\nG28\n").completed);
}

TEST(Inspector, BuiltButNotAskedIsUnexplained) {
    Built built;
    built.firmware.move_to({10, 0, 0, 0});
    built.firmware.move_to({10, 1, 0, 0});
    const Report report = built.report("G1 X10\n");
    EXPECT_TRUE(report.completed);
    EXPECT_FALSE(report.matches);
    EXPECT_EQ(report.findings.axes[1].unexplained, 80u);
    EXPECT_NEAR(report.findings.axes[1].path_deviation_mm_max, 1.0, 1e-9);
}

TEST(Inspector, ADetourThatReturnsIsSeen) {
    Built built;
    built.firmware.move_to({10, 0, 0, 0});
    built.firmware.move_to({10, 0.5, 0, 0});
    built.firmware.move_to({10, 0, 0, 0});
    built.firmware.move_to({20, 0, 0, 0});
    EXPECT_FALSE(built.report("G1 X10\nG1 X20\n").matches);
}

TEST(Inspector, AnAskedDetourThatWasLeftOutIsSeen) {
    Built built;
    built.firmware.move_to({10, 0, 0, 0});
    built.firmware.move_to({20, 0, 0, 0});
    EXPECT_FALSE(built.report("G1 X10\nG1 Y0.5\nG1 Y0\nG1 X20\n").matches);
}

TEST(Inspector, RelativeMovesInchesAndRenamedPositions) {
    Built built;
    built.firmware.move_to({5, 5, 0, 0});
    built.firmware.move_to({7, 5, 0, 0.5});
    built.firmware.move_to({7 + 25.4, 5, 0, 0.5});
    built.firmware.move_to({1, 5, 0, 1.5});
    const Report report = built.report(
        "G1 X5 Y5\nG91\nG1 X2 E.5\nG20\nG1 X1\nG21\nG90\nM82\nG92 X100 E0\n"
        "G1 X68.6 E1\n");  // 100 names the place at 32.4, so 68.6 is 1
    EXPECT_TRUE(report.matches) << explain(report);
}

TEST(Inspector, RelativeExtruderAndFlow) {
    Built built;
    built.firmware.move_to({10, 0, 0, 1});
    built.firmware.move_to({20, 0, 0, 2.1});
    built.firmware.move_to({30, 0, 0, 3.2});
    const Report report = built.report("M83\nG1 X10 E1\nM221 S110\nG1 X20 E1\nG1 X30 E1\n");
    EXPECT_TRUE(report.matches) << explain(report);
    EXPECT_NEAR(report.findings.filament_asked_mm, 3.2, 1e-9);
}

TEST(Inspector, RetractionsBetweenTravels) {
    Built built;
    const auto to = [&](double x, double y, double e) { built.firmware.move_to({x, y, 0.2, e}); };
    to(0, 0, 0);
    to(0, 0, -0.8);
    to(40, 20, -0.8);
    to(40, 20, 0);
    to(47.433, 22.749, 0.26);
    to(47.433, 22.749, -0.54);
    to(10, 10, -0.54);
    to(10, 10, 0.26);
    const Report report = built.report(
        "G1 Z.2\nG1 E-.8\nG92 E0\nG1 X40 Y20\nG1 E.8\nG1 X47.433 Y22.749 E1.06\nG1 E.26\nG1 X10 Y10\nG1 "
        "E1.06\n");
    EXPECT_TRUE(report.matches) << explain(report);
    EXPECT_NEAR(report.findings.filament_asked_pushed_mm, 0.8 + 0.26 + 0.8, 1e-9);
    EXPECT_NEAR(report.findings.filament_built_pushed_mm, 0.8 + 0.26 + 0.8, 3.0 / 96);
    EXPECT_LE(report.findings.axes[kExtruder].path_deviation_mm_max, 0.52 / 96);
}

TEST(Inspector, AMissingRetractionIsSeenThoughTheNetIsRight) {
    Built built;
    built.firmware.move_to({10, 0, 0, 0});
    built.firmware.move_to({20, 0, 0, 0});
    const Report report = built.report("G1 X10\nG1 E-.8\nG1 X20\nG1 E0\n");
    EXPECT_FALSE(report.matches);
    EXPECT_NEAR(report.findings.axes[kExtruder].path_deviation_mm_max, 0.8, 1e-9);
}

TEST(Inspector, EndsOnAHalfStepEitherWay) {
    for (const double nudge : {-1e-9, 1e-9}) {
        Built built;
        built.firmware.move_to({0, 0, 0.325 + nudge, 0});  // 656.5 steps
        built.firmware.move_to({5, 0, 0.325 + nudge, 0});
        built.firmware.move_to({5, 0, 0.125 + nudge, 0});
        const Report report = built.report("G1 Z.325\nG1 X5\nG1 Z.125\n");
        EXPECT_TRUE(report.matches) << nudge << explain(report);
    }
}

TEST(Inspector, ArcsByCentreAndByRadius) {
    Built built;
    const auto arc = [&](double cx, double cy, double radius, double from, double sweep, double e0,
                         double e1) {
        for (int i = 1; i <= 2000; ++i) {
            const double angle = from + sweep * i / 2000;
            built.firmware.move_to(
                {cx + radius * std::cos(angle), cy + radius * std::sin(angle), 0, e0 + (e1 - e0) * i / 2000});
        }
    };
    constexpr double kPi = std::numbers::pi;
    built.firmware.move_to({30, 20, 0, 0});
    arc(20, 20, 10, 0, kPi / 2, 0, 0.5);         // anticlockwise to (20, 30)
    arc(20, 20, 10, kPi / 2, -kPi / 2, 0.5, 1);  // clockwise back
    arc(20, 20, 10, 0, 2 * kPi, 1, 3);           // whole turn
    arc(20, 20, 10, 0, -1.5 * kPi, 3, 4);        // the long way round, to (20, 30)
    const Report report = built.report(
        "G1 X30 Y20\nG3 X20 Y30 I-10 J0 E.5\nG2 X30 Y20 R10 E1\nG3 X30 Y20 I-10 E3\nG2 X20 Y30 R-10 E4\n");
    EXPECT_TRUE(report.matches) << explain(report);
}

TEST(Inspector, HomingThenPrinting) {
    Built built;
    built.firmware.home({0, 1, 2});
    built.firmware.move_to({0, 0, 5, 0});
    built.firmware.move_to({46.282, 63.412, 0.2, 0});
    built.firmware.move_to({47.433, 62.749, 0.2, 0.04});
    const Report report =
        built.report("G28 ; home\nG1 Z5\nG1 X46.282 Y63.412 Z.2\nG1 X47.433 Y62.749 E.04\n");
    EXPECT_TRUE(report.matches) << explain(report);
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) EXPECT_TRUE(report.findings.axes[axis].homed);
    EXPECT_NEAR(report.findings.axes[0].final_built_mm, 47.433, 0.5 / 80 + 1e-9);
}

TEST(Inspector, HomingAgainFromTheSwitchAndFromAfar) {
    Built built;
    built.firmware.home({0, 1, 2});
    built.firmware.home({0});  // it already stands on the switch
    built.firmware.move_to({20, 30, 1, 0});
    built.firmware.home({0});
    const Report report = built.report("G28\nG28 X\nG1 X20 Y30 Z1\nG28 X0\nM84\n");
    EXPECT_TRUE(report.matches) << explain(report);
    EXPECT_DOUBLE_EQ(report.findings.axes[0].final_built_mm, 0.0);
    EXPECT_DOUBLE_EQ(report.findings.axes[1].final_built_mm, 30.0);
}

/// A short print with an excursion in the middle.
struct Paused {
    Machine machine{};
    NaiveFirmware firmware{machine};
    std::size_t back = 0;
    explicit Paused(const std::array<int, kAxisCount>& away) {
        firmware.home({0, 1, 2});
        firmware.move_to({10.003, 20.007, 1, 0.777});
        firmware.move_to({30.1, 20.007, 1, 1.777});
        back = firmware.excursion(away);
        firmware.move_to({30.1, 44.04, 1, 2.9});
        firmware.move_to({12.5, 44.04, 1, 3.9});
    }
    [[nodiscard]] Report report(std::uint64_t told) const {
        return judged(
            inspect(machine,
                    "G28\nG1 X10.003 Y20.007 Z1 E.777\nG1 X30.1 E1.777\nG1 Y44.04 E2.9\nG1 X12.5 E3.9\n",
                    firmware.events, firmware.start()),
            told);
    }
};

TEST(Inspector, AnExcursionThatComesBackToTheStepIsNoDifference) {
    for (const std::array<int, kAxisCount> away :
         {std::array{2000, 3000, 10'000, -192}, std::array{0, 0, 10'000, 0}, std::array{4000, 0, 0, 5000},
          std::array{0, 0, 0, 4000}, std::array{1600, 0, 0, 0}, std::array{8, 0, 0, 0}}) {
        const Paused paused(away);
        const Report report = paused.report(1);
        EXPECT_TRUE(report.matches) << explain(report);
        EXPECT_EQ(report.findings.excursions, 1u);
        EXPECT_FALSE(paused.report(0).matches) << "a detour that nobody tells of is a difference";
    }
}

/// It lifts Z from an open switch; a homing draws back from a closed one only.
TEST(Inspector, AnExcursionJustBeforeAHomingIsToldFromIt) {
    for (const int beside : {0, 1}) {
        Built built;
        built.firmware.home({0, 1, 2});
        built.firmware.move_to({20, 20, 1, 0});
        const std::size_t back = built.firmware.excursion({2000, 3000, 10'000, 0});
        auto& events = built.firmware.events;
        events.erase(events.begin() + static_cast<std::ptrdiff_t>(back),
                     events.begin() + static_cast<std::ptrdiff_t>(back) + beside);
        built.firmware.home({0, 1, 2});
        built.firmware.home({2});
        built.firmware.move_to({5, 5, 0, 0});
        const Report report = judged(inspect(built.machine, "G28\nG1 X20 Y20 Z1\nG28\nG28 Z\nG1 X5 Y5\n",
                                             events, built.firmware.start()),
                                     1);
        EXPECT_EQ(report.matches, beside == 0) << explain(report);
    }
}

/// From closed switches a pause looks like a homing until others follow: pins alone cannot tell
/// which was which, and need not.
TEST(Inspector, ExcursionsAndHomingsFromTheSwitchesInAnyOrder) {
    struct Way {
        const char* gcode;
        Position to;
    };
    for (const Way& way : {Way{"G1 X10 Y10\n", {10, 10, 0, 0}}, Way{"G1 Z0.3\nG1 X9\n", {0, 0, 0.3, 0}},
                           Way{"G1 X10 Y10 Z1\n", {10, 10, 1, 0}}, Way{"G1 E2\nG1 X9 E3\n", {0, 0, 0, 2}}}) {
        for (const std::string order : {"PH", "PPH", "HP", "HPPH", "PPPHPHH", "PPHPPHPP", "PX", "PPX", "PPZ",
                                        "PPXPPYPPZPP", "pH", "ppH", "ppppH", "PpPpHpPH", "qqH", "qPpH"}) {
            Built built;
            built.firmware.home({0, 1, 2});
            std::string gcode = "G28\n";
            std::uint64_t pauses = 0;
            for (const char what : order) {
                if (what == 'P') built.firmware.excursion({0, 12'000, 10'100, 0});
                if (what == 'p') built.firmware.excursion({2000, 3000, 10'000, -192});
                if (what == 'q') built.firmware.excursion({0, 0, 10'000, 0});
                if (what == 'P' || what == 'p' || what == 'q') {
                    ++pauses;
                    continue;
                }
                if (what == 'H') built.firmware.home({0, 1, 2});
                if (what == 'X') built.firmware.home({0});
                if (what == 'Y') built.firmware.home({1});
                if (what == 'Z') built.firmware.home({2});
                gcode += what == 'H' ? "G28\n" : std::string{"G28 "} + what + '\n';
            }
            built.firmware.move_to(way.to);
            if (std::string_view{way.gcode}.find("X9") != std::string_view::npos)
                built.firmware.move_to({9, 0, way.to[2], way.to[3] > 0 ? 3.0 : 0.0});
            const Findings findings =
                inspect(built.machine, gcode + way.gcode, built.firmware.events, built.firmware.start());
            const Report report = judged(findings, pauses);
            EXPECT_TRUE(report.matches) << order << ' ' << way.gcode << explain(report);
        }
    }
}

/// A pause that began as a homing does is judged, too: one step beside is a difference.
TEST(Inspector, AnExcursionFromTheSwitchesThatLosesAStepIsADifference) {
    for (const int axis : {1, 2}) {
        Built built;
        built.firmware.home({0, 1, 2});
        (void)built.firmware.excursion({0, 12'000, 10'100, 0});
        const std::size_t back = built.firmware.excursion({0, 12'000, 10'100, 0});
        built.firmware.home({0});
        built.firmware.move_to({10, 10, 0.5, 0});
        auto& events = built.firmware.events;
        events.erase(std::find_if(events.begin() + static_cast<std::ptrdiff_t>(back), events.end(),
                                  [&](const Event& event) { return event.axis == axis; }));
        const Report report = judged(
            inspect(built.machine, "G28\nG28 X\nG1 X10 Y10 Z0.5\n", events, built.firmware.start()), 2);
        EXPECT_FALSE(report.matches) << axis << explain(report);
    }
}

TEST(Inspector, OneStepBesideAfterAnExcursionIsADifference) {
    for (const int axis : {0, 1, 2}) {
        Paused paused({2000, 3000, 10'000, -192});
        std::vector<Event>& events = paused.firmware.events;
        const auto lost = std::find_if(events.begin() + static_cast<std::ptrdiff_t>(paused.back),
                                       events.end(), [&](const Event& event) { return event.axis == axis; });
        events.erase(lost);
        const Report report = paused.report(1);
        EXPECT_FALSE(report.matches);
        EXPECT_THAT(report.differences,
                    ::testing::Contains(::testing::HasSubstr("did not come back to the step")))
            << explain(report);
    }
}

TEST(Inspector, WhatIsNotTakenBackIsNoExcursion) {
    Paused paused({2000, 0, 0, 0});
    std::vector<Event>& events = paused.firmware.events;
    events.erase(events.begin() + static_cast<std::ptrdiff_t>(paused.back),
                 events.begin() + static_cast<std::ptrdiff_t>(paused.back) + 2000);
    EXPECT_FALSE(paused.report(5).matches);
}

TEST(Inspector, HomingForgetsARenamedPosition) {
    Built built;
    built.firmware.home({0, 1, 2});
    built.firmware.move_to({10, 10, 0, 0});
    built.firmware.home({0});
    built.firmware.move_to({5, 5, 0, 0});
    const Report report = built.report("G28\nG1 X10 Y10\nG92 X0 Y0\nG28 X\nG1 X5 Y-5\n");
    EXPECT_TRUE(report.matches) << explain(report);
}

TEST(Inspector, AnUnfinishedHomingIsNotCompleted) {
    Built built;
    built.firmware.home({0, 1, 2});
    std::vector<Event> cut(built.firmware.events.begin(), built.firmware.events.end() - 300);
    const Findings findings = inspect(built.machine, "G28\n", cut, built.firmware.start());
    EXPECT_FALSE(findings.path_consumed);
    EXPECT_TRUE(findings.axes[0].homed);
    EXPECT_FALSE(findings.axes[2].homed);
}

TEST(Inspector, ASecondJobBeginsWhereTheFirstEnded) {
    Machine machine;
    NaiveFirmware firmware(machine);
    firmware.home({0, 1, 2});
    firmware.move_to({10.003, 20.007, 1, 0.777});
    TextSource first("G28\nG1 X10.003 Y20.007 Z1 E.777\n");
    Inspector inspector(machine, first, firmware.start());
    std::array<std::int64_t, kAxisCount> position = firmware.start().built;
    for (const Event& event : firmware.events) {
        if (event.kind != Event::Kind::step) {
            inspector.on_endstop(instant_from_ns(event.time_ns), event.axis,
                                 event.kind == Event::Kind::closes);
            continue;
        }
        const auto axis = static_cast<std::size_t>(event.axis);
        position[axis] += event.direction;
        inspector.on_step({instant_from_ns(event.time_ns), static_cast<std::uint8_t>(axis),
                           static_cast<std::int8_t>(event.direction), position[axis]});
    }
    ASSERT_TRUE(judged(inspector.finish(firmware.now())).matches);
    const std::size_t already = firmware.events.size();
    firmware.move_to({30, 40, 1, 1.777});
    firmware.move_to({10, 5, 1, 2.777});
    const std::vector<Event> rest(firmware.events.begin() + static_cast<std::ptrdiff_t>(already),
                                  firmware.events.end());
    const Report report =
        judged(inspect(machine, "G92 E0\nG1 X30 Y40 E1\nG1 X10 Y5 E2\n", rest, inspector.next_start()));
    EXPECT_TRUE(report.matches) << explain(report);
}

// An axis that turns just past a half step crosses the same boundary twice, there and back. The
// cursor must wait at the second crossing, behind the corner: waiting at the first, it took the
// corner for a deviation of up to 1.5 steps.
TEST(Inspector, TurningJustPastAHalfStepIsNoDeviation) {
    Built built;
    built.firmware.move_to({10.0175, 0, 0, 0});  // 801.4 steps: 800.5 is crossed on the way up …
    built.firmware.move_to({5, 0.3, 0, 0});      // … and on the way down, before Y has moved
    built.firmware.move_to({10.0175, 0.3, 0, 0});
    built.firmware.move_to({5, 0.6, 0, 0});
    const Report report = built.report("G1 X10.0175\nG1 X5 Y.3\nG1 X10.0175\nG1 X5 Y.6\n");
    EXPECT_TRUE(report.matches) << explain(report);
    EXPECT_LE(report.findings.axes[0].path_deviation_mm_max, 0.55 / 80);
}

// On a shallow line the next step of X is 40 steps of Y away: a spurious one must not drag the
// cursor there.
TEST(Inspector, ASpuriousStepOnAShallowLineIsBlamedOnItsAxisAlone) {
    Built built;
    built.firmware.move_to({1, 40, 0, 0});
    auto& events = built.firmware.events;
    const auto at = events.begin() + 1500;
    events.insert(at, {Event::Kind::step, at->time_ns, 0, 1});
    const Report report = built.report("G1 X1 Y40\n");
    EXPECT_FALSE(report.matches);
    EXPECT_GE(report.findings.axes[0].unexplained, 1u);
    EXPECT_NEAR(report.findings.axes[0].path_deviation_mm_max * 80, 1.5, 0.2) << explain(report);
    EXPECT_LE(report.findings.axes[1].path_deviation_mm_max * 80, 3.0) << explain(report);
}

// After another job the extruder's zero is known to a microstep only, and that is 25 microsteps of
// X.
TEST(Inspector, TheExtrudersZeroMayBeOffWithoutBlamingTheSlides) {
    Built built;
    built.firmware.move_to({30, 11, 0, 1.0});
    built.firmware.move_to({5, 40, 0, 2.5});
    for (const double off : {-0.9, 0.9}) {
        InspectionStart start = built.firmware.start();
        start.origin[kExtruder] += off;
        const Report report =
            judged(inspect(built.machine, "G1 X30 Y11 E1\nG1 X5 Y40 E2.5\n", built.firmware.events, start));
        for (const std::size_t axis : {0, 1})
            EXPECT_LE(report.findings.axes[axis].path_deviation_mm_max, 0.6 / 80) << off << explain(report);
        EXPECT_NEAR(report.findings.axes[kExtruder].path_deviation_mm_max, 1.4 / 96, 0.1 / 96) << off;
    }
}

TEST(Inspector, TooMuchFilamentIsBlamedOnTheExtruderAlone) {
    Built built;
    built.firmware.move_to({30, 11, 0, 2.1});
    built.firmware.move_to({5, 40, 0, 4.2});
    const Report report = built.report("G1 X30 Y11 E2\nG1 X5 Y40 E4\n");
    EXPECT_FALSE(report.matches);
    for (const std::size_t axis : {0, 1})
        EXPECT_LE(report.findings.axes[axis].path_deviation_mm_max, 0.6 / 80) << explain(report);
    EXPECT_NEAR(report.findings.axes[kExtruder].path_deviation_mm_max, 0.2, 0.02);
}

TEST(Inspector, AnExtruderStepInMidHomingIsBlamedOnTheExtruderAlone) {
    Built built;
    built.firmware.move_to({20, 0, 0, 0});
    const std::size_t homing = built.firmware.events.size();
    built.firmware.home({0});
    auto& events = built.firmware.events;
    const Event wrong{Event::Kind::step, events[homing + 100].time_ns, kExtruder, 1};
    events.insert(events.begin() + static_cast<std::ptrdiff_t>(homing + 100), wrong);
    const Report report = built.report("G1 X20\nG28 X\n");
    EXPECT_TRUE(report.completed);
    EXPECT_FALSE(report.matches);
    EXPECT_LE(report.findings.axes[0].path_deviation_mm_max, 0.6 / 80) << explain(report);
}

TEST(Inspector, AStepOfAnotherAxisIsNoPartOfHoming) {
    Built built;
    built.firmware.move_to({20, 10, 0, 0});
    const std::size_t homing = built.firmware.events.size();
    built.firmware.home({0});
    auto& events = built.firmware.events;
    const Event wrong{Event::Kind::step, events[homing].time_ns, 1, 1};
    events.insert(events.begin() + static_cast<std::ptrdiff_t>(homing), wrong);
    const Report report = built.report("G1 X20 Y10\nG28 X\n");
    EXPECT_FALSE(report.matches);
    EXPECT_EQ(report.findings.axes[1].unexplained, 1u);
    EXPECT_FALSE(report.findings.axes[1].final_exact);
}

// ---- wrong builds must be seen ------------------------------------------------------------------

const char* const kSquare =
    "G28\nG1 Z.2\nG1 X20 Y20\nG1 X60 Y20 E1.5\nG1 X60 Y60 E3\nG1 X21.5 Y58.25 E4.5\nG1 X20 Y20 E6\nG1 Z.4\n"
    "G1 X61 Y21 E8\nG1 X20 Y40 E10\n";

Built square() {
    Built built;
    built.firmware.home({0, 1, 2});
    for (const Position& to :
         {Position{0, 0, .2, 0}, Position{20, 20, .2, 0}, Position{60, 20, .2, 1.5}, Position{60, 60, .2, 3},
          Position{21.5, 58.25, .2, 4.5}, Position{20, 20, .2, 6}, Position{20, 20, .4, 6},
          Position{61, 21, .4, 8}, Position{20, 40, .4, 10}})
        built.firmware.move_to(to);
    return built;
}

// Index of the `nth` step of `axis` after homing.
std::size_t step_of(const Built& built, int axis, int nth) {
    std::size_t homed = 0;
    for (std::size_t i = 0; i < built.firmware.events.size(); ++i)
        if (built.firmware.events[i].kind == Event::Kind::closes) homed = i;
    for (std::size_t i = homed + 1; i < built.firmware.events.size(); ++i) {
        const Event& event = built.firmware.events[i];
        if (event.kind == Event::Kind::step && event.axis == axis && nth-- == 0) return i;
    }
    ADD_FAILURE() << "no such step";
    return homed;
}

TEST(InspectorMutants, TheUnspoiltSquareMatches) {
    const Report report = square().report(kSquare);
    EXPECT_TRUE(report.matches) << explain(report);
}

TEST(InspectorMutants, OneStepDropped) {
    for (const int axis : {0, 1, 2}) {
        Built built = square();
        auto& events = built.firmware.events;
        events.erase(events.begin() + static_cast<std::ptrdiff_t>(step_of(built, axis, 300)));
        const Report report = built.report(kSquare);
        EXPECT_FALSE(report.matches) << axis;
        const AxisFindings& found = report.findings.axes[static_cast<std::size_t>(axis)];
        EXPECT_FALSE(found.final_exact) << axis;
        EXPECT_GT(found.path_deviation_mm_max * machine_steps(axis), 0.99) << axis << explain(report);
    }
}

TEST(InspectorMutants, OneStepTooMany) {
    for (const int axis : {0, 1, 2}) {
        Built built = square();
        auto& events = built.firmware.events;
        const std::size_t at = step_of(built, axis, 300);
        events.insert(events.begin() + static_cast<std::ptrdiff_t>(at), events[at]);
        const Report report = built.report(kSquare);
        EXPECT_FALSE(report.matches) << axis;
        EXPECT_FALSE(report.findings.axes[static_cast<std::size_t>(axis)].final_exact) << axis;
    }
}

TEST(InspectorMutants, OneStepTheWrongWay) {
    Built built = square();
    built.firmware.events[step_of(built, 0, 500)].direction *= -1;
    const Report report = built.report(kSquare);
    EXPECT_FALSE(report.matches);
    EXPECT_GT(report.findings.axes[0].path_deviation_mm_max, 0.0125);
}

TEST(InspectorMutants, StepsOfOneAxisDelayed) {
    Built built = square();
    auto& events = built.firmware.events;
    // Three X steps of the last diagonal are held back behind the twelve events that follow them.
    const std::size_t at = step_of(built, 0, static_cast<int>((20 + 40 + 38.5 + 1.5 + 41 + 20) * 80));
    std::vector<Event> held;
    for (std::size_t i = at; held.size() < 3; ++i)
        if (events[i].axis == 0) held.push_back(events[i]);
    std::size_t removed = 0;
    std::erase_if(events, [&](const Event& event) {
        const auto index = static_cast<std::size_t>(&event - events.data());
        if (index < at || event.axis != 0 || removed == 3) return false;
        ++removed;
        return true;
    });
    events.insert(events.begin() + static_cast<std::ptrdiff_t>(at + 12), held.begin(), held.end());
    const Report report = built.report(kSquare);
    EXPECT_FALSE(report.matches);
    EXPECT_TRUE(report.findings.axes[0].final_exact);
    EXPECT_GT(report.findings.axes[0].path_deviation_mm_max + report.findings.axes[1].path_deviation_mm_max,
              0.02);
}

TEST(InspectorMutants, WrongLayer) {
    Built built;
    built.firmware.home({0, 1, 2});
    for (const Position& to :
         {Position{0, 0, .2, 0}, Position{20, 20, .2, 0}, Position{60, 20, .2, 1.5}, Position{60, 60, .2, 3},
          Position{21.5, 58.25, .2, 4.5}, Position{20, 20, .2, 6}, Position{61, 21, .2, 8},
          Position{20, 40, .2, 10}, Position{20, 40, .4, 10}})
        built.firmware.move_to(to);
    const Report report = built.report(kSquare);
    EXPECT_FALSE(report.matches);
    EXPECT_GT(report.findings.axes[2].path_deviation_mm_max, 0.1) << explain(report);
}

TEST(InspectorMutants, ExtruderShortByAThousandth) {
    Built built;
    const auto go = [&](double share) {
        NaiveFirmware firmware(built.machine);
        for (int i = 1; i <= 40; ++i) firmware.move_to({i % 2 * 50.0, i * 1.0, 0, i * 1.7 * share});
        return firmware;
    };
    std::string gcode;
    for (int i = 1; i <= 40; ++i)
        gcode += "G1 X" + std::to_string(i % 2 * 50) + " Y" + std::to_string(i) + " E" +
                 std::to_string(i * 1.7) + "\n";
    const NaiveFirmware right = go(1.0);
    EXPECT_TRUE(judged(inspect(built.machine, gcode, right.events, right.start())).matches);
    const NaiveFirmware wrong = go(0.999);
    const Report report = judged(inspect(built.machine, gcode, wrong.events, wrong.start()));
    EXPECT_FALSE(report.matches);
    EXPECT_THAT(report.differences, ::testing::Contains(::testing::HasSubstr("filament")));
    EXPECT_LE(report.findings.axes[0].path_deviation_mm_max, 0.0125) << "the slides are as asked";
    EXPECT_LE(report.findings.axes[1].path_deviation_mm_max, 0.0125);
}

TEST(InspectorMutants, AMotorThatStopsIsReportedAndTheRestIsStillFollowed) {
    Built built = square();
    auto& events = built.firmware.events;
    const std::size_t at = step_of(built, 0, 3000);
    std::size_t dropped = 0;
    for (std::size_t i = at; i < events.size() && dropped < 40;) {  // half a millimetre of X
        if (events[i].kind == Event::Kind::step && events[i].axis == 0) {
            events.erase(events.begin() + static_cast<std::ptrdiff_t>(i));
            ++dropped;
        } else {
            ++i;
        }
    }
    const Report report = built.report(kSquare);
    EXPECT_FALSE(report.matches);
    EXPECT_GT(report.findings.axes[0].path_deviation_mm_max, 0.45) << explain(report);
    EXPECT_LT(report.findings.axes[0].path_deviation_mm_max, 1.0) << explain(report);
    EXPECT_NEAR(report.findings.axes[0].final_built_mm, 19.5, 0.1);
    EXPECT_EQ(report.findings.axes[1].final_built_mm, 40.0);
}

TEST(InspectorMutants, RandomNoiseEndsAndDoesNotMatch) {
    Built built = square();
    std::uint32_t state = 12345;
    for (int i = 0; i < 200'000; ++i) {
        state = state * 1664525u + 1013904223u;
        built.firmware.events.push_back({Event::Kind::step, 1'000'000'000'000 + i * std::int64_t{1000},
                                         static_cast<int>(state >> 30), (state >> 20 & 1) != 0 ? 1 : -1});
    }
    EXPECT_FALSE(built.report(kSquare).matches);
}

}  // namespace
}  // namespace qduino::twin::inspector_test
