#include "printer/machine/job_actions.h"

#include <gtest/gtest.h>

#include "tests/unit/machine/fake_loops.h"

namespace qduino::printer::machine::job_actions_test {
namespace {

struct Bench {
    MachineConfig config;
    std::unique_ptr<link::LinkLayout> layout = std::make_unique<link::LinkLayout>();
    LinkEnd link{*layout};
    std::unique_ptr<MotionPipe> pipe = std::make_unique<MotionPipe>(config, layout->emergency);
    NotedMotors pins;
    Motors motors{Kinematics{config}, pins};
    Heating heating{config, layout->heat_status};
    std::unique_ptr<Places> places = std::make_unique<Places>();
    HomingRun homing{config, *pipe, motors};
    BedProfiles profiles{config};
    JobActions actions{{config, link, *pipe, motors, heating, *places, homing, profiles}};

    explicit Bench(const MachineConfig& with = {}) : config(with) {
        link.status().outcome = link::JobOutcome::running;
    }
    void pass_all() {
        places->pass(last, [&](const Place& place) { actions.pass(place); });
    }
    /// As loop 3 sees it.
    double fan_duty() { return heating.sample(instant_from_ns(0), {Celsius{20}, Celsius{20}, 0}, false).fan; }
    gcode::Move move_x(double to_mm) {
        gcode::Move move;
        move.to[Axis::x] = Millimetres{to_mm};
        move.feedrate = MillimetresPerSecond{50};
        move.source = {0, 17, 3, 16};
        return move;
    }
    std::uint32_t last = 1;
};

TEST(JobActions, WhatAJobAsksForHappensAtItsPlace) {
    Bench bench;
    ASSERT_TRUE(bench.actions.set_fan(0, 0.5).ok());
    EXPECT_EQ(bench.fan_duty(), 0);
    EXPECT_FALSE(bench.places->all_passed());
    bench.pass_all();
    EXPECT_EQ(bench.fan_duty(), 0.5);
}

TEST(JobActions, WhatAJobSaysInEveryLayerIsSaidOnce) {
    Bench bench;
    const auto says = [&](std::string_view text, Speaker speaker = Speaker::job) {
        const auto before = bench.layout->replies.pushed();
        bench.actions.set_speaker(speaker);
        bench.actions.note(gcode::NoteKind::not_done, text, {});
        return bench.layout->replies.pushed() != before;
    };
    EXPECT_TRUE(says("a"));
    EXPECT_TRUE(says("b"));
    EXPECT_FALSE(says("a"));
    EXPECT_TRUE(says("a", Speaker::person)) << "who types is answered";
    EXPECT_FALSE(says("b"));
    bench.link.status().job_id = 2;
    EXPECT_TRUE(says("a")) << "another job";
}

TEST(JobActions, WhatIsTypedHappensAtOnce) {
    Bench bench;
    bench.actions.set_speaker(Speaker::person);
    ASSERT_TRUE(bench.actions.set_fan(0, 0.5).ok());
    EXPECT_EQ(bench.fan_duty(), 0.5);
    EXPECT_TRUE(bench.places->all_passed());
    ASSERT_TRUE(bench.actions.set_fan(1, 1).ok());
    EXPECT_EQ(bench.fan_duty(), 0.5) << "there is one fan";
}

TEST(JobActions, AMoveSwitchesItsMotorOnAndCarriesTheJobsProgress) {
    Bench bench;
    ASSERT_TRUE(bench.actions.move(bench.move_x(10)).ok());
    EXPECT_EQ(bench.pins.log, "X+");
    EXPECT_EQ(bench.pipe->planner().position_mm()[0], 10);
    EXPECT_EQ(bench.link.status().bytes_executed, 0u);
    bench.pass_all();
    EXPECT_EQ(bench.link.status().bytes_executed, 17u);
    EXPECT_EQ(bench.link.status().line, 3u);
    EXPECT_EQ(bench.link.status().layer, 0u) << "nothing is laid down yet";
}

TEST(JobActions, LayersAreFoundFromExtrusionsAndToldWhenTheyHaveBeenMade) {
    Bench bench;
    static_cast<void>(bench.heating.sample(instant_from_ns(0), {Celsius{200}, Celsius{20}, 0}, false));
    bench.heating.observe(instant_from_ns(0));
    gcode::Move move = bench.move_x(10);
    move.kind = gcode::MoveKind::print;
    for (const double z : {0.3, 0.6, 0.61, 0.9}) {
        move.from = move.to;
        move.to[Axis::x] = move.from[Axis::x] + Millimetres{1};
        move.to[Axis::z] = Millimetres{z};
        move.to[Axis::e] = move.from[Axis::e] + Millimetres{0.1};
        ASSERT_TRUE(bench.actions.move(move).ok());
    }
    EXPECT_EQ(bench.link.status().layer, 0u);
    bench.pass_all();
    EXPECT_EQ(bench.link.status().layer, 1u);
    bench.last = 4;
    bench.pass_all();
    EXPECT_EQ(bench.link.status().layer, 3u);
}

TEST(JobActions, AHeaterThatAPersonTakesFromAJobIsARequestAndItsTargetIsKept) {
    Bench bench;
    bench.heating.set_target(gcode::Heater::hot_end, Celsius{200});
    const auto asks = [&](gcode::Heater heater, double celsius) {
        EXPECT_TRUE(bench.actions.set_temperature(heater, Celsius{celsius}).ok());
        return bench.actions.take_request();
    };
    EXPECT_FALSE(asks(gcode::Heater::hot_end, 0)) << "the job's own line";
    bench.places->forget();
    bench.actions.set_speaker(Speaker::person);
    EXPECT_FALSE(asks(gcode::Heater::hot_end, 190)) << "warm enough to print on";
    EXPECT_FALSE(asks(gcode::Heater::bed, 0)) << "it is off already";
    EXPECT_FALSE(bench.heating.keeps_targets());
    const std::optional<Request> request = asks(gcode::Heater::hot_end, 0);
    ASSERT_TRUE(request.has_value());
    EXPECT_EQ(std::get<HeatTaken>(*request).heater, gcode::Heater::hot_end);
    EXPECT_TRUE(bench.heating.keeps_targets());
    bench.heating.ask_for_kept();
    EXPECT_TRUE(bench.heating.takes_heat(gcode::Heater::hot_end, Celsius{169})) << "190 is kept";
    bench.link.status().outcome = link::JobOutcome::completed;
    EXPECT_FALSE(asks(gcode::Heater::hot_end, 0)) << "no job counts on it";
}

TEST(JobActions, ATypedMoveIsNoProgressOfTheJob) {
    Bench bench;
    bench.actions.set_speaker(Speaker::person);
    EXPECT_FALSE(bench.actions.move(bench.move_x(10)).ok()) << "nobody knows where X is";
    bench.heating.set_minimum_extrude(Celsius{0});
    gcode::Move of_filament = bench.move_x(0);
    of_filament.to[Axis::e] = Millimetres{1};
    ASSERT_TRUE(bench.actions.move(of_filament).ok());
    EXPECT_FALSE(bench.places->all_passed()) << "it is waited for all the same";
    bench.pass_all();
    EXPECT_EQ(bench.link.status().bytes_executed, 0u);
}

TEST(JobActions, AColdMoveOfFilamentIsRefusedAndNothingIsSwitchedOn) {
    Bench bench;
    gcode::Move move = bench.move_x(10);
    move.to[Axis::e] = Millimetres{1};
    EXPECT_FALSE(bench.actions.move(move).ok());
    EXPECT_EQ(bench.pins.log, "");
    EXPECT_TRUE(bench.pipe->planner().empty());
}

TEST(JobActions, MotorsThatGoOffTakeTheirHomingWithThem) {
    Bench bench;
    ASSERT_TRUE(bench.actions.move(bench.move_x(10)).ok());
    ASSERT_TRUE(bench.actions.motors_off(gcode::AxisSet{}.add(Axis::x).add(Axis::e)).ok());
    EXPECT_EQ(bench.pins.log, "X+");
    bench.last = 2;
    bench.pass_all();
    EXPECT_EQ(bench.pins.log, "X+X-E-");
    ASSERT_TRUE(bench.actions.move(bench.move_x(20)).ok());
    EXPECT_EQ(bench.pins.log, "X+X-E-X+") << "on again for the next move";
}

TEST(JobActions, AMachineWithoutABedHeatsNone) {
    MachineConfig config;
    config.has_bed = false;
    Bench bench(config);
    EXPECT_FALSE(
        bench.actions.wait_temperature(gcode::Heater::bed, Celsius{60}, gcode::WaitFor::heating).ok());
    EXPECT_FALSE(bench.heating.wait().active());
    EXPECT_TRUE(bench.actions.set_temperature(gcode::Heater::bed, Celsius{}).ok()) << "off is what it is";
}

TEST(JobActions, RequestsAreTakenOnce) {
    Bench bench;
    EXPECT_FALSE(bench.actions.take_request().has_value());
    bench.actions.emergency_stop();
    const std::optional<Request> emergency = bench.actions.take_request();
    ASSERT_TRUE(emergency.has_value());
    EXPECT_TRUE(std::holds_alternative<EmergencyAsked>(*emergency));
    EXPECT_FALSE(bench.actions.take_request().has_value());
    bench.actions.report(gcode::Report::position);
    EXPECT_EQ(std::get<gcode::Report>(*bench.actions.take_request()), gcode::Report::position);
}

TEST(JobActions, OnlyAJobPausesItself) {
    Bench bench;
    ASSERT_TRUE(bench.actions.pause({.text = "take it off"}).ok());
    EXPECT_TRUE(std::holds_alternative<PauseAsked>(*bench.actions.take_request()));
    EXPECT_EQ(bench.link.status().message.view(), "take it off");
    bench.actions.set_speaker(Speaker::person);
    ASSERT_TRUE(bench.actions.pause({}).ok());
    EXPECT_FALSE(bench.actions.take_request().has_value());
    bench.actions.set_speaker(Speaker::job);
    bench.link.status().outcome = link::JobOutcome::completed;
    ASSERT_TRUE(bench.actions.pause({}).ok());
    EXPECT_FALSE(bench.actions.take_request().has_value());
}

TEST(JobActions, LimitsChangeWhatIsAppendedNext) {
    Bench bench;
    gcode::LimitChange change;
    change.axis_speed[0] = MillimetresPerSecond{77};
    change.travel_acceleration = MillimetresPerSecond2{500};
    ASSERT_TRUE(bench.actions.set_limits(change).ok());
    EXPECT_EQ(bench.pipe->planner().settings().max_speed[Axis::x].value(), 77);
    EXPECT_EQ(bench.pipe->accelerations().of(gcode::MoveKind::travel), 500);
    EXPECT_EQ(bench.pipe->accelerations().of(gcode::MoveKind::print),
              bench.config.default_acceleration.value());
}

}  // namespace
}  // namespace qduino::printer::machine::job_actions_test
