// Random paths, stepped by brute force (tests/unit/twin/naive_firmware.h): the right build must
// match, a build with one thing wrong must not. Every failure names its seed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "tests/unit/twin/naive_firmware.h"
#include "twin/report.h"

namespace qduino::twin::inspector_property_test {
namespace {

using testing::Event;
using testing::inspect;
using testing::NaiveFirmware;

/// A job as a slicer writes it, and the same as waypoints: the two come from one stream of
/// decisions, not from each other.
class RandomJob {
  public:
    /// `paused`: here and there the head leaves the path and comes back, which the G-code says
    /// nothing of.
    explicit RandomJob(std::uint64_t seed, bool paused = false)
        : paused_(paused), random_(seed), firmware(machine) {
        if (chance(0.7)) home();
        if (chance(0.3)) say("M83"), relative_e_ = true;
        const int moves = 15 + static_cast<int>(random_() % 25);
        for (int i = 0; i < moves; ++i) any_command();
    }

    Machine machine{};

  private:
    bool paused_;
    std::mt19937_64 random_;

  public:
    NaiveFirmware firmware;
    std::string gcode;
    std::size_t excursions = 0;
    /// Nothing but excursions is behind `returns[which]`.
    [[nodiscard]] bool is_last_way(std::size_t which) const {
        return back_at_ == firmware.events.size() && which >= first_from_here_;
    }
    std::vector<std::size_t> returns;  ///< first event of the way back of each excursion

  private:
    bool chance(double probability) { return std::uniform_real_distribution<>(0, 1)(random_) < probability; }
    /// A number with three decimals, as slicers write them, so that text and waypoint are the same
    /// double.
    double number(double from, double to) {
        return std::round(std::uniform_real_distribution<>(from, to)(random_) * 1000) / 1000;
    }
    static std::string text(double value) {
        char buffer[32];
        std::snprintf(buffer, sizeof buffer, "%.5f", value);
        return buffer;
    }
    void say(const std::string& line) { gcode += line + "\n"; }
    void excursion() {
        std::array<int, kAxisCount> away{};
        for (int& steps : away) steps = chance(0.6) ? 80 + static_cast<int>(random_() % 3000) : 0;
        if (chance(0.5)) away[kExtruder] = -192;
        if (away == std::array<int, kAxisCount>{}) away[2] = 500;
        if (back_at_ != firmware.events.size()) first_from_here_ = returns.size();
        returns.push_back(firmware.excursion(away));
        ++excursions;
        back_at_ = firmware.events.size();
    }
    void any_command() {
        if (paused_ && chance(0.15)) return excursion();
        // An excursion right before a homing is not told from it.
        if (chance(0.04) && firmware.events.size() >= back_at_ + 500) return home();
        if (chance(0.15)) return retract();
        if (chance(0.06)) return say("G92 E" + text(rename_e()));
        if (chance(0.05)) return lift();
        if (chance(0.15)) return tiny_moves();
        line(chance(0.15) ? number(-8, 8) : number(0.5, 20), chance(0.5));
    }
    double rename_e() { return logical_e_ = number(0, 5); }
    void home() {
        say("G28");
        firmware.home({0, 1, 2});
        at_ = firmware.at_mm();
    }
    void lift() {
        // Whole steps: on a half step (2020 · 0.225 = 454.5) one step fewer is as right, and would
        // be a mutant that lives.
        at_[2] = std::round(number(0, 2) * 20) / 20;
        go("G0 Z" + text(at_[2]));
    }
    void retract() {
        const double length = 0.8;
        extrude(-length, "G1");
        line(number(1, 10), false);
        extrude(length, "G1");
    }
    void extrude(double length, const std::string& begin) {
        logical_e_ = std::round((logical_e_ + length) * 1e5) / 1e5;
        at_[3] += length;
        go(begin + " E" + text(relative_e_ ? length : logical_e_));
    }
    void line(double length, bool print) {
        const double angle = number(0, 6.283);
        at_[0] = std::round(std::clamp(at_[0] + length * std::cos(angle), 0.0, 60.0) * 1000) / 1000;
        at_[1] = std::round(std::clamp(at_[1] + length * std::sin(angle), 0.0, 60.0) * 1000) / 1000;
        const std::string begin = "G1 X" + text(at_[0]) + " Y" + text(at_[1]);
        if (!print) return go(begin);
        const double e = std::round(std::abs(length) * 0.033 * 1e5) / 1e5;
        extrude(e, begin);
    }
    void tiny_moves() {
        for (int i = 0; i < 12; ++i) line(number(0, 0.05), chance(0.7));
    }
    void go(const std::string& command) {
        say(command + (chance(0.1) ? " F1800 ; comment X5" : ""));
        firmware.move_to(at_);
    }

    std::size_t back_at_ = 0;          // first event after the last excursion
    std::size_t first_from_here_ = 0;  // the first of the last ones, which are from one place
    Position at_{};
    double logical_e_ = 0;
    bool relative_e_ = false;
};

Report judged(const Findings& findings, std::uint64_t excursions_told) {
    Report report;
    report.findings = findings;
    report.excursions_told = excursions_told;
    judge(report, Machine{});
    return report;
}

Report report_of(const RandomJob& job, const std::vector<Event>& events) {
    return judged(inspect(job.machine, job.gcode, events, job.firmware.start()), job.excursions);
}

TEST(InspectorProperty, WhatIsBuiltRightMatches) {
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        const RandomJob job(seed);
        const Report report = report_of(job, job.firmware.events);
        ASSERT_TRUE(report.matches) << "seed " << seed << "\n" << to_json(report) << "\n" << job.gcode;
        for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
            const double steps =
                report.findings.axes[axis].path_deviation_mm_max * job.machine.axes[axis].steps_per_mm;
            ASSERT_LE(steps, 0.6) << "seed " << seed << " axis " << axis;
            ASSERT_EQ(report.findings.axes[axis].unexplained, 0u) << "seed " << seed << " axis " << axis;
        }
    }
}

TEST(InspectorProperty, ExcursionsThatComeBackMatch) {
    std::size_t excursions = 0;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        const RandomJob job(seed, true);
        const Report report = report_of(job, job.firmware.events);
        ASSERT_TRUE(report.matches) << "seed " << seed << "\n" << to_json(report, 0) << "\n" << job.gcode;
        ASSERT_LE(report.findings.excursions, job.excursions);
        excursions += report.findings.excursions;
    }
    ASSERT_GT(excursions, 100u);
}

TEST(InspectorProperty, AnExcursionThatEndsAStepBesideIsSeen) {
    int mutants = 0;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        const RandomJob job(seed, true);
        for (std::size_t which = 0; which < job.returns.size(); ++which) {
            const std::size_t back = job.returns[which];
            std::vector<Event> events = job.firmware.events;
            if (back >= events.size() || events[back].axis == kExtruder) continue;
            // At the end of a job a machine may leave its part, and need not come back.
            if (job.is_last_way(which)) continue;
            events.erase(events.begin() + static_cast<std::ptrdiff_t>(back));
            ASSERT_FALSE(report_of(job, events).matches) << "seed " << seed << " at " << back << "\n"
                                                         << job.gcode;
            ++mutants;
        }
    }
    ASSERT_GT(mutants, 100);
}

/// Steps outside of homing, which the inspector skips, as indices.
std::vector<std::size_t> printing_steps(const std::vector<Event>& events, int axis) {
    std::size_t homed = 0;
    for (std::size_t i = 0; i < events.size(); ++i)
        if (events[i].kind == Event::Kind::closes) homed = i + 1;
    std::vector<std::size_t> found;
    for (std::size_t i = homed; i < events.size(); ++i)
        if (events[i].kind == Event::Kind::step && events[i].axis == axis) found.push_back(i);
    return found;
}

/// Applies `spoil(events, index)` to one random step of X, Y or Z per seed; none of the results may
/// match.
template <typename Spoil>
void expect_every_mutant_dies(Spoil spoil) {
    int mutants = 0;
    for (std::uint64_t seed = 100; seed < 130; ++seed) {
        const RandomJob job(seed);
        std::mt19937_64 random(seed);
        for (int axis = 0; axis < kSlideCount; ++axis) {
            std::vector<Event> events = job.firmware.events;
            const std::vector<std::size_t> steps = printing_steps(events, axis);
            if (steps.size() < 10) continue;
            spoil(events, steps[random() % steps.size()]);
            const Report report = report_of(job, events);
            ASSERT_FALSE(report.matches) << "seed " << seed << " axis " << axis;
            ++mutants;
        }
    }
    ASSERT_GT(mutants, 40);
}

TEST(InspectorProperty, AStepDroppedIsSeen) {
    expect_every_mutant_dies([](std::vector<Event>& events, std::size_t at) {
        events.erase(events.begin() + static_cast<std::ptrdiff_t>(at));
    });
}

TEST(InspectorProperty, AStepDoubledIsSeen) {
    expect_every_mutant_dies([](std::vector<Event>& events, std::size_t at) {
        events.insert(events.begin() + static_cast<std::ptrdiff_t>(at), events[at]);
    });
}

TEST(InspectorProperty, AStepReversedIsSeen) {
    expect_every_mutant_dies(
        [](std::vector<Event>& events, std::size_t at) { events[at].direction = -events[at].direction; });
}

TEST(InspectorProperty, AStepMovedFarAheadOfItsPlaceIsSeen) {
    int mutants = 0;
    for (std::uint64_t seed = 200; seed < 230; ++seed) {
        const RandomJob job(seed);
        std::vector<Event> events = job.firmware.events;
        // The last ten steps of X are sent while X still has a millimetre and more to go, and Y
        // moves in between.
        const std::vector<std::size_t> x = printing_steps(events, 0);
        const std::vector<std::size_t> y = printing_steps(events, 1);
        if (x.size() < 400 || y.size() < 400) continue;
        const std::size_t from = x[x.size() - 300];
        if (std::ranges::count_if(y, [&](std::size_t i) { return i > from && i < x[x.size() - 20]; }) < 100)
            continue;
        std::vector<Event> moved;
        for (std::size_t i = x.size() - 10; i < x.size(); ++i) moved.push_back(events[x[i]]);
        for (std::size_t i = x.size(); i-- > x.size() - 10;)
            events.erase(events.begin() + static_cast<std::ptrdiff_t>(x[i]));
        events.insert(events.begin() + static_cast<std::ptrdiff_t>(from), moved.begin(), moved.end());
        ASSERT_FALSE(report_of(job, events).matches) << "seed " << seed;
        ++mutants;
    }
    ASSERT_GT(mutants, 10);
}

TEST(InspectorProperty, ACutStreamIsNotCompleted) {
    for (std::uint64_t seed = 300; seed < 330; ++seed) {
        const RandomJob job(seed);
        const std::vector<std::size_t> x = printing_steps(job.firmware.events, 0);
        if (x.size() < 50) continue;
        const std::vector<Event> cut(
            job.firmware.events.begin(),
            job.firmware.events.begin() + static_cast<std::ptrdiff_t>(x[x.size() - 20]));
        ASSERT_FALSE(report_of(job, cut).matches) << "seed " << seed;
    }
}

TEST(InspectorProperty, NoiseNeverHangsNorMatches) {
    for (std::uint64_t seed = 400; seed < 406; ++seed) {
        const RandomJob job(seed);
        std::mt19937_64 random(seed);
        std::vector<Event> events;
        for (int i = 0; i < 60'000; ++i)
            events.push_back(
                {random() % 50 == 0 ? (random() % 2 == 0 ? Event::Kind::closes : Event::Kind::opens)
                                    : Event::Kind::step,
                 std::int64_t{i} * 100'000, static_cast<int>(random() % 3), random() % 2 == 0 ? 1 : -1});
        ASSERT_FALSE(report_of(job, events).matches) << "seed " << seed;
    }
}

}  // namespace
}  // namespace qduino::twin::inspector_property_test
