// Heights of lines that are moved as a real machine moves: speeding up, going on, slowing down. The
// steps are worked out here from the motion, for each axis by itself.
#include "twin/height_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "tests/unit/twin/text_source.h"
#include "twin/inspector.h"
#include "twin/print_record.h"

namespace qduino::twin::height_map_test {
namespace {

struct Step {
    std::int64_t time_ns = 0;
    int axis = 0;
    int direction = 0;
};

/// Writes G-code, and the steps of a machine that follows it.
class Machinist {
  public:
    explicit Machinist(const Machine& machine) : machine_(machine) {}

    /// A line to there at `speed`, from rest to rest, with `acceleration`.
    void move(const Position& to, double speed, double acceleration = 2000) {
        say(to);
        double way = std::max(std::hypot(to[0] - at_[0], to[1] - at_[1]), std::abs(to[2] - at_[2]));
        if (way == 0) way = std::abs(to[3] - at_[3]);
        const std::size_t first = steps.size();
        for (std::size_t axis = 0; axis < kAxisCount; ++axis)
            follow(axis, to[axis], way, speed, acceleration);
        std::stable_sort(steps.begin() + static_cast<std::ptrdiff_t>(first), steps.end(),
                         [](const Step& a, const Step& b) { return a.time_ns < b.time_ns; });
        now_ns_ += static_cast<std::int64_t>(time_at(way, way, speed, acceleration) * 1e9);
        at_ = to;
    }
    [[nodiscard]] const Position& at() const { return at_; }

    std::string gcode = "G92 E0\n";
    std::vector<Step> steps;
    int line = 1;  ///< the last one written
    double flow = 1;
    bool loses_retractions = false;

  private:
    void say(const Position& to) {
        char text[120];
        std::snprintf(text, sizeof text, "G1 X%.6f Y%.6f Z%.6f E%.6f\n", to[0], to[1], to[2], to[3]);
        gcode += text;
        ++line;
    }
    /// When `s` of `way` is passed, in s.
    static double time_at(double s, double way, double speed, double acceleration) {
        const double ramp = std::min(speed * speed / (2 * acceleration), way / 2);
        const double top = std::sqrt(2 * acceleration * ramp);
        const double cruise_s = (way - 2 * ramp) / top;
        if (s <= ramp) return std::sqrt(2 * s / acceleration);
        if (s <= way - ramp) return top / acceleration + (s - ramp) / top;
        return 2 * top / acceleration + cruise_s - std::sqrt(std::max(2 * (way - s), 0.0) / acceleration);
    }
    void follow(std::size_t axis, double to, double way, double speed, double acceleration) {
        const bool extruder = axis == kExtruder;
        if (extruder && loses_retractions && way == std::abs(to - at_[axis])) return;
        const double per_mm = machine_.axes[axis].steps_per_mm * (extruder ? flow : 1);
        const double begin = at_[axis], end = to;
        const int direction = end > begin ? 1 : -1;
        const auto whole = [&](double mm) {
            return static_cast<std::int64_t>(std::floor(mm * per_mm + 0.5));
        };
        for (std::int64_t n = whole(begin); n != whole(end); n += direction) {
            const double crossing = (static_cast<double>(n) + 0.5 * direction) / per_mm;
            const double s = way * (crossing - begin) / (end - begin);
            const double t = time_at(std::clamp(s, 0.0, way), way, speed, acceleration);
            steps.push_back({now_ns_ + static_cast<std::int64_t>(std::llround(t * 1e9)),
                             static_cast<int>(axis), direction});
        }
    }

    Machine machine_;
    Position at_{};
    std::int64_t now_ns_ = 1'000'000'000;
};

Heights heights_of(const Machine& machine, const Machinist& part) {
    TextSource source(part.gcode);
    Inspector inspector(machine, source, InspectionStart::at_power_on(machine, {}, {}));
    PrintRecord record(machine, kEpoch, true);
    std::array<std::int64_t, kAxisCount> position{};
    Instant now{};
    for (const Step& step : part.steps) {
        now = instant_from_ns(step.time_ns);
        std::int64_t& place = position[static_cast<std::size_t>(step.axis)];
        place += step.direction;
        const StepSeen seen{now, static_cast<std::uint8_t>(step.axis),
                            static_cast<std::int8_t>(step.direction), place};
        inspector.on_step(seen);
        record.on_step(seen, inspector);
    }
    return record.finish(now);
}

constexpr double kFilamentPerMm = 0.0333;
const double kAskedHeight = std::numbers::pi / 4 * 1.75 * 1.75 * kFilamentPerMm / 0.4;

/// One long line, and the way to it.
Machinist long_line(double flow = 1) {
    Machinist part{Machine{}};
    part.flow = flow;
    part.move({20, 20, 0.2, 0}, 100);
    part.move({100, 50, 0.2, 85.44 * kFilamentPerMm}, 50);
    return part;
}

TEST(HeightMap, WhereTheSpeedIsEvenTheHeightIsTheOneAskedFor) {
    const Heights found = heights_of(Machine{}, long_line());
    EXPECT_LT(static_cast<double>(found.error_nm.quantile(0.5)) * 1e-6, 0.01 * kAskedHeight);
    EXPECT_NEAR(found.asked_mm3, kAskedHeight * 0.4 * 85.44, 0.05);
    EXPECT_EQ(found.late_spot_count, 0u);
    EXPECT_NEAR(found.way_mm, 85.44, 0.05);
}

TEST(HeightMap, OnePerCentOfFlowIsOnePerCentOfHeight) {
    const Heights found = heights_of(Machine{}, long_line(1.01));
    EXPECT_NEAR(static_cast<double>(found.error_nm.quantile(0.5)) * 1e-6, 0.01 * kAskedHeight,
                0.002 * kAskedHeight);
}

// The paper's equation 3: ΔH = K δt, and H = K / f: so ΔH / H = f δt.
TEST(HeightMap, ALateStepIsFoundAtItsPlaceAndAsThickAsThePaperSays) {
    for (const double late_us : {50.0, 200.0, 1000.0}) {
        Machinist part = long_line();
        const auto is_x = [](const Step& step) { return step.axis == 0; };
        // In the middle of the line, where X crosses 60 mm.
        std::int64_t x = 0;
        const auto late = std::ranges::find_if(part.steps, [&](const Step& step) {
            x += is_x(step) ? step.direction : 0;
            return x == 4800;
        });
        ASSERT_NE(late, part.steps.end());
        for (auto step = late; step != part.steps.end(); ++step)
            step->time_ns += static_cast<std::int64_t>(late_us * 1000);
        const Heights found = heights_of(Machine{}, part);
        ASSERT_EQ(found.late_spots.size(), 1u) << late_us;
        const LateSpot& spot = found.late_spots[0];
        EXPECT_EQ(spot.place.line, 3u);
        EXPECT_NEAR(spot.place.mm[0], 60, 0.03);
        EXPECT_NEAR(spot.place.mm[1], 35, 0.03);
        EXPECT_NEAR(spot.late_s, late_us * 1e-6, 1e-6);
        // The spot is one to two microsteps of the path long.
        const double rise = 50 * late_us * 1e-6 * kAskedHeight;  // v δt H: over 1 mm
        EXPECT_GT(spot.rise_mm, rise / (2.1 / 80));
        EXPECT_LT(spot.rise_mm, 1.02 * rise / (0.999 / 80));
    }
}

TEST(HeightMap, ALateStepIsALighterShadeInThePicture) {
    Machinist part = long_line();
    const Heights without = heights_of(Machine{}, part);
    for (Step& step : part.steps)
        if (step.time_ns > part.steps[part.steps.size() / 2 + 4000].time_ns) step.time_ns += 3'000'000;
    const Heights with = heights_of(Machine{}, part);
    ASSERT_EQ(with.cells.size(), without.cells.size());
    std::size_t differ = 0;
    for (std::size_t i = 0; i < with.cells.size(); ++i)
        differ += std::abs(with.cells[i].error - without.cells[i].error) > 0.1f;
    EXPECT_GE(differ, 1u);
    EXPECT_LE(differ, 3u) << "only where the head stood";
}

// A part of short lines and travels, with retractions.
Machinist comb(std::uint64_t seed, bool loses_retractions = false) {
    std::mt19937_64 random(seed);
    const auto number = [&](double from, double to) {
        return std::round(std::uniform_real_distribution<>(from, to)(random) * 1000) / 1000;
    };
    Machinist part{Machine{}};
    part.loses_retractions = loses_retractions;
    Position at{20, 20, 0.2, 0};
    part.move(at, 100);
    for (int i = 0; i < 12; ++i) {
        for (int line = 0; line < 3; ++line) {
            const double x = number(20, 120), y = number(20, 120);
            at = {x, y, 0.2,
                  at[3] + std::round(std::hypot(x - at[0], y - at[1]) * kFilamentPerMm * 1e5) / 1e5};
            part.move(at, number(10, 120), number(500, 5000));
        }
        at[3] -= 0.8;
        part.move(at, 35, 5000);
        at[0] = number(20, 120);
        part.move(at, 120);
        at[3] += 0.8;
        part.move(at, 35, 5000);
    }
    return part;
}

TEST(HeightMap, NoCellReachesAcrossATravel) {
    const Heights found = heights_of(Machine{}, comb(2));
    ASSERT_GT(found.cells.size(), 1000u);
    std::size_t begun = 0;
    for (std::size_t i = 0; i < found.cells.size(); ++i) {
        const HeightCell& cell = found.cells[i];
        begun += cell.joined ? 0 : 1;
        if (!cell.joined) continue;
        const HeightCell& before = found.cells.at(i - 1);
        EXPECT_LT(std::hypot(cell.x_mm - before.x_mm, cell.y_mm - before.y_mm), HeightMap::kCellMm + 0.05);
    }
    EXPECT_EQ(begun, 12u) << "one after each travel";
}

TEST(HeightMap, RandomLinesWithoutLatenessHaveNoLateSpot) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed)
        EXPECT_EQ(heights_of(Machine{}, comb(seed)).late_spot_count, 0u) << "seed " << seed;
}

TEST(HeightMap, LateStepsInsideLinesAreFound) {
    std::mt19937_64 random(7);
    int found_in = 0;
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        Machinist part = comb(seed);
        // A step of X or Y with 400 others of its line around it.
        std::size_t at = 0;
        do at = random() % (part.steps.size() - 800) + 400;
        while (part.steps[at].axis > 1 ||
               part.steps[at + 400].time_ns - part.steps[at - 400].time_ns > 400'000'000);
        for (std::size_t i = at; i < part.steps.size(); ++i) part.steps[i].time_ns += 2'000'000;
        const Heights found = heights_of(Machine{}, part);
        // On a travel nothing is laid, and where two lines meet nothing is judged.
        if (found.late_spot_count == 0) continue;
        ++found_in;
        EXPECT_EQ(found.late_spots.size(), 1u) << "seed " << seed;
        EXPECT_NEAR(found.late_spots[0].late_s, 2e-3, 1e-4) << "seed " << seed;
    }
    EXPECT_GE(found_in, 6) << "of ten; the others are on travels";
}

// A return so quick that the head hardly rests.
TEST(HeightMap, AReturnOfFilamentAsksForNoHeight) {
    Machinist part{Machine{}};
    part.move({20, 20, 0.2, 0}, 100);
    part.move({40, 20, 0.2, 20 * kFilamentPerMm}, 30);
    part.move({40, 20, 0.2, 20 * kFilamentPerMm - 0.3}, 60, 50'000);
    part.move({40, 60, 0.2, 20 * kFilamentPerMm - 0.3}, 120);
    part.move({40, 60, 0.2, 20 * kFilamentPerMm}, 60, 50'000);
    part.move({40, 100, 0.2, 60 * kFilamentPerMm}, 30);
    const Heights found = heights_of(Machine{}, part);
    EXPECT_NEAR(found.asked_mm3, kAskedHeight * 0.4 * 60, 0.02);
    EXPECT_NEAR(found.way_mm, 60, 0.1);
    EXPECT_LT(std::abs(found.worst_error_mm), 1.5 * kAskedHeight);
}

TEST(HeightMap, ALostRetractionIsSeenAsOoze) {
    const Heights right = heights_of(Machine{}, comb(3));
    const Heights lost = heights_of(Machine{}, comb(3, true));
    EXPECT_LT(right.travel_ooze_mm3, 0.5);
    EXPECT_GT(lost.travel_ooze_mm3, 4 * right.travel_ooze_mm3);
    ASSERT_FALSE(lost.oozes.empty());
    EXPECT_GT(lost.oozes[0].way_mm, 1);
    EXPECT_GT(lost.oozes[0].volume_mm3, 3 * right.oozes[0].volume_mm3);
}

TEST(HeightMap, WhatWasPushedIsLaidOrOozedOrStillInTheNozzle) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        const Machine machine;
        const Machinist part = comb(seed);
        TextSource source(part.gcode);
        Inspector inspector(machine, source, InspectionStart::at_power_on(machine, {}, {}));
        HeightMap map(machine, false);
        std::array<std::int64_t, kAxisCount> position{};
        double pushed_mm3 = 0;
        for (const Step& step : part.steps) {
            const Instant now = instant_from_ns(step.time_ns);
            position[static_cast<std::size_t>(step.axis)] += step.direction;
            inspector.on_step({now, static_cast<std::uint8_t>(step.axis),
                               static_cast<std::int8_t>(step.direction),
                               position[static_cast<std::size_t>(step.axis)]});
            if (step.axis == kExtruder) {
                map.extruder_step(now, step.direction);
                pushed_mm3 += step.direction * machine.step_volume_mm3();
                continue;
            }
            std::array<double, kAxisCount> mm;
            for (std::size_t axis = 0; axis < kAxisCount; ++axis)
                mm[axis] = inspector.asked_steps()[axis] / machine.axes[axis].steps_per_mm;
            if (step.axis < 2) map.slide_step(now, mm, inspector.line(), true);
        }
        const Heights found = map.finish(instant_from_ns(part.steps.back().time_ns + 1'000'000));
        const double out = found.laid_mm3 + found.travel_ooze_mm3 + found.rest_ooze_mm3;
        const double inside = found.in_nozzle_mm3 + machine.melt.idle_ooze_mm3;
        EXPECT_NEAR(pushed_mm3, out + inside, 1e-6) << "seed " << seed;
    }
}

TEST(LineClock, TimeBelongsToTheLineThatMoves) {
    LineClock clock{kEpoch};
    clock.step(kEpoch + 5s, 1);  // it heated up
    clock.step(kEpoch + 5s + 100ms, 1);
    clock.step(kEpoch + 5s + 400ms, 7);
    EXPECT_NEAR(clock.rested_s(), 5, 1e-6);
    EXPECT_NEAR(clock.seconds().at(1), 0.1, 1e-6);
    EXPECT_NEAR(clock.seconds().at(7), 0.3, 1e-6);
}

TEST(StepRates, ThePeakIsOverSixteenSteps) {
    StepRates rates;
    Instant now{};
    for (int i = 0; i < 100; ++i) rates.step(now += 200us, 0);
    rates.step(now + 1us, 0);  // one early step is no speed
    EXPECT_NEAR(rates.peak(0), 16 / (15 * 200e-6 + 1e-6), 1);
    EXPECT_EQ(rates.peak(1), 0);
}

}  // namespace
}  // namespace qduino::twin::height_map_test
