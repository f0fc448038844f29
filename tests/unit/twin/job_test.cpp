#include "twin/job.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string>

#include "tests/unit/twin/pin_player.h"
#include "tests/unit/twin/text_source.h"

namespace qduino::twin::job_test {
namespace {

using testing::PinPlayer;

constexpr Nanoseconds us(std::int64_t microseconds) { return Nanoseconds{microseconds * 1000}; }

std::unique_ptr<ByteSource> text(const std::string& gcode) { return std::make_unique<TextSource>(gcode); }

// A square wall of two layers, straight along the axes so that the pins can be driven by counting.
const char* const kWall =
    "G28\nG1 Z.2\nG1 X20 Y20\nM83\nG1 X40 E1\nG1 Y40 E1\nG1 X20 E1\nG1 Y20 E1\nG1 Z.4\nG1 X40 E1\nG1 Y40 "
    "E1\nG1 X20 E1\n"
    "G1 Y20 E1\n";

class Wall {
  public:
    explicit Wall(Printer& printer) : player(printer) {}
    PinPlayer player;

    void home() {
        for (const int axis : {0, 1, 2}) player.home(axis);
    }
    void go(int axis, double mm) {
        const double per_mm = Machine{}.axes[static_cast<std::size_t>(axis)].steps_per_mm;
        player.steps(axis, mm > 0 ? 1 : -1, static_cast<int>(std::lround(std::abs(mm) * per_mm)), us(300));
    }
    // 20 mm of X or Y with 1 mm of filament: 1600 steps with 96 in between, each after its half.
    void wall(int axis, int direction) {
        int pushed = 0;
        for (int step = 0; step < 1600; ++step) {
            const double crossed = (step + 0.5) * 96 / 1600;
            while (pushed + 0.5 < crossed) {
                player.step(kExtruder, 1, us(30));
                ++pushed;
            }
            player.step(axis, direction, us(300));
        }
        for (; pushed < 96; ++pushed) player.step(kExtruder, 1, us(300));
    }
    void print() {
        home();
        go(2, 0.2);
        // The diagonal from 0,0 to 20,20: both at once.
        for (int i = 0; i < 1600; ++i) {
            player.step(0, 1, us(5));
            player.step(1, 1, us(300));
        }
        for (int layer = 0; layer < 2; ++layer) {
            if (layer == 1) go(2, 0.2);
            for (const auto& [axis, direction] : {std::pair{0, 1}, {1, 1}, {0, -1}, {1, -1}})
                wall(axis, direction);
        }
    }
};

TEST(TwinJob, AWallDrivenOverPinsIsWhatWasAsked) {
    Printer printer{Machine{}};
    Wall wall(printer);
    wall.player.heat(kHotEnd, 0.42);
    wall.player.wait(900s);
    Job job(printer, text(kWall), wall.player.now);
    wall.print();
    wall.player.wait(100ms);
    const Report report = job.finish(wall.player.now);
    EXPECT_TRUE(report.completed);
    EXPECT_TRUE(report.matches) << to_json(report);
    EXPECT_DOUBLE_EQ(report.findings.filament_built_mm, 8.0);
    EXPECT_EQ(report.lost_steps, (std::array<std::uint64_t, kAxisCount>{}));
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        EXPECT_LE(std::abs(report.findings.axes[axis].homing_error_mm), 0.0126);
    EXPECT_EQ(report.cold_extrusion_steps, 0u);
    EXPECT_GT(report.hot_end.minimum_celsius, 160);
    EXPECT_LT(report.hot_end.maximum_celsius, 240);
}

TEST(TwinJob, LayersHaveTheHeightOfThePapersEquation) {
    Machine machine;
    Printer printer{machine};
    Wall wall(printer);
    Job job(printer, text(kWall), wall.player.now);
    wall.print();
    wall.player.wait(100ms);
    const Report report = job.finish(wall.player.now);
    ASSERT_EQ(report.layers.size(), 2u);
    // 1 mm of 1.75 mm filament over 20 mm at a line width of 0.4 mm.
    const double expected = std::numbers::pi / 4 * 1.75 * 1.75 / 20 / 0.4;
    double volume = 0;
    for (const Layer& layer : report.layers) {
        EXPECT_NEAR(layer.height_mean_mm(), expected, 0.02 * expected);
        EXPECT_NEAR(layer.length_mm, 80, 0.5);
        EXPECT_NEAR(layer.minimum_x_mm, 20, 0.3);
        EXPECT_NEAR(layer.maximum_y_mm, 40, 0.3);
        EXPECT_LT(layer.height_deviation_mm(), 0.1 * expected);
        volume += layer.volume_mm3;
    }
    EXPECT_NEAR(report.layers[0].z_mm, 0.2, 0.001);
    EXPECT_NEAR(report.layers[1].z_mm, 0.4, 0.001);
    EXPECT_NEAR(volume, report.volume_mm3, 1e-9);
    EXPECT_NEAR(volume, 8 * std::numbers::pi / 4 * 1.75 * 1.75, 0.1);
}

TEST(TwinDeposit, ARetractionAndItsReturnLayNothing) {
    const Machine machine;
    Deposit deposit(machine, 0);
    std::int64_t position = 0;
    double x = 0;
    const auto push = [&](int steps, int direction, double way) {
        for (int i = 0; i < steps; ++i) deposit.extruder_at(position += direction, {x += way, 0, 0.2});
    };
    push(960, 1, 0.3);
    push(77, -1, 0);
    x += 50;  // travel
    push(77, 1, 0);
    push(960, 1, 0.3);
    deposit.finish();
    const double step = std::numbers::pi / 4 * 1.75 * 1.75 / 96;
    EXPECT_NEAR(deposit.volume_mm3(), 1920 * step, 1e-6);
    ASSERT_EQ(deposit.layers().size(), 1u);
    EXPECT_NEAR(deposit.layers()[0].length_mm, 1918 * 0.3, 0.1) << "the travel is no line";
    EXPECT_NEAR(deposit.layers()[0].height_maximum_mm, step / 0.4 / 0.3, 1e-3);
}

TEST(TwinDeposit, LayersBeyondTheLimitGoIntoTheLast) {
    Deposit deposit(Machine{}, 0);
    const int layers = static_cast<int>(Deposit::kLayerLimit) + 5;
    for (int i = 1; i <= layers; ++i) deposit.extruder_at(i, {0, 0, i * 0.1});
    EXPECT_EQ(deposit.layers().size(), Deposit::kLayerLimit);
    EXPECT_EQ(deposit.layers_merged(), 5u);
    double volume = 0;
    for (const Layer& layer : deposit.layers()) volume += layer.volume_mm3;
    EXPECT_NEAR(volume, deposit.volume_mm3(), 1e-6);
}

TEST(TwinJob, ColdPlasticIsCounted) {
    Printer printer{Machine{}};
    Wall wall(printer);
    Job job(printer, text(kWall), wall.player.now);
    wall.print();
    const Report report = job.finish(wall.player.now + 100ms);
    EXPECT_EQ(report.cold_extrusion_steps, 8u * 96u);
}

TEST(TwinJob, ABrokenPulseIsALostStepAndADifference) {
    Printer printer{Machine{}};
    PinPlayer player(printer);
    Job job(printer, text("G1 X1\n"), player.now);
    for (int i = 0; i < 80; ++i) player.step(0, 1, us(300), i == 40 ? Nanoseconds{900} : us(2));
    const Report report = job.finish(player.now);
    EXPECT_FALSE(report.matches);
    EXPECT_EQ(report.lost_steps[0], 1u);
    EXPECT_EQ(report.timing_violations, 1u);
    EXPECT_FALSE(report.findings.axes[0].final_exact);
}

TEST(TwinJob, TheNextJobBeginsWhereThisOneEnded) {
    Printer printer{Machine{}};
    Wall wall(printer);
    Job first(printer, text("G28\nG1 X10 Y5\n"), wall.player.now);
    wall.home();
    // 10 : 5 — every second step of X one of Y, at the half steps.
    for (int i = 0; i < 800; ++i) {
        wall.player.step(0, 1, us(300));
        if (i % 2 == 1) wall.player.step(1, 1, us(300));
    }
    ASSERT_TRUE(first.finish(wall.player.now).matches);
    Job second(printer, text("G1 X12\nG1 Y6\n"), wall.player.now, first.next_start());
    wall.go(0, 2);
    wall.go(1, 1);
    const Report report = second.finish(wall.player.now);
    EXPECT_TRUE(report.matches) << to_json(report);
    EXPECT_EQ(report.findings.axes[0].steps, 160u) << "only its own";
    wall.go(0, -3);  // somebody jogs
    Job third(printer, text("G1 X10\n"), wall.player.now, second.next_start());
    wall.go(0, 1);
    EXPECT_TRUE(third.finish(wall.player.now).matches);
}

// A third of a step is over at the end of each. A machine counts filament from where its motor
// stands when a job begins: what is over does not add up.
TEST(TwinJob, EachJobCountsItsFilamentFromTheStepThatItBeginsOn) {
    Printer printer{Machine{}};
    PinPlayer player(printer);
    std::optional<InspectionStart> place;
    for (const char* const mode : {"M83\n", "M82\n", "M83\n", "M82\n", "M82\n"}) {
        Job job(printer, text(std::string{mode} + "G1 E0.1\nG1 X0 E0.10347\n"), player.now, place);
        player.steps(kExtruder, 1, std::string{mode} == "M83\n" ? 20 : 10, us(300));
        const Report report = job.finish(player.now);
        EXPECT_TRUE(report.matches) << to_json(report);
        place = job.next_start();
    }
}

TEST(TwinJob, AJobThatIsDroppedStopsWatching) {
    Printer printer{Machine{}};
    PinPlayer player(printer);
    { Job job(printer, text("G1 X1\n"), player.now); }
    player.steps(0, 1, 10, us(300));
    Job job(printer, text("G1 X1\n"), player.now);
    player.steps(0, 1, 80, us(300));
    EXPECT_TRUE(job.finish(player.now).matches);
}

TEST(TwinReport, IsJsonWithTheFiguresOfTheJob) {
    Printer printer{Machine{}};
    PinPlayer player(printer);
    Job job(printer, text("G1 X1\nG1 Y1\n"), player.now);
    player.steps(0, 1, 80, us(300));
    const nlohmann::json json = nlohmann::json::parse(to_json(job.finish(player.now)));
    EXPECT_FALSE(json.at("completed"));
    EXPECT_FALSE(json.at("matches"));
    EXPECT_FALSE(json.at("differences").empty());
    EXPECT_EQ(json.at("steps").at("x"), 80);
    EXPECT_DOUBLE_EQ(json.at("final_position_mm").at("built").at("x"), 1.0);
    EXPECT_DOUBLE_EQ(json.at("final_position_mm").at("asked").at("y"), 1.0);
    EXPECT_TRUE(json.at("temperature_c").at("hot_end").is_null()) << "nothing was extruded";
}

}  // namespace
}  // namespace qduino::twin::job_test
