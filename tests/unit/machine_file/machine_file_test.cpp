#include "config/machine_file.h"

#include <gtest/gtest.h>

namespace qduino::apps::machine_file_test {
namespace {

using printer::Axis;

std::string error_of(std::string_view text) {
    const auto parsed = parse_machine(text, "m.toml");
    return parsed ? "" : std::string(parsed.error().message.view());
}

TEST(MachineFile, EmptyFileIsTheReferenceMachine) {
    const auto parsed = parse_machine("", "m.toml");
    ASSERT_TRUE(parsed);
    EXPECT_EQ(parsed->axes[Axis::z].steps_per_mm, 2020);
    EXPECT_EQ(parsed->name.view(), "Printrbot Simple Metal");
}

TEST(MachineFile, KeysReplaceValues) {
    const auto parsed = parse_machine(
        "[axes.x]\nmax_speed_mm_s = 200\nmax_acceleration_mm_s2 = 3000\n[bed]\nki = 1\n", "m.toml");
    ASSERT_TRUE(parsed);
    EXPECT_EQ(parsed->axes[Axis::x].max_speed, 200_mm_s);
    EXPECT_EQ(parsed->axes[Axis::x].max_acceleration, 3000_mm_s2);
    EXPECT_EQ(parsed->axes[Axis::y].max_speed, 125_mm_s);
    EXPECT_EQ(parsed->bed.ki, 1);
}

TEST(MachineFile, ErrorsNameFileLineAndKey) {
    EXPECT_TRUE(error_of("\n[axes.x]\nspeed = 3\n")
                    .starts_with(
                        "m.toml:3: [axes.x] 'speed' is not known; accepted: steps_per_mm, max_speed_mm_s, "));
    EXPECT_EQ(error_of("has_bed = 1\n"), "m.toml:1: 'has_bed' is 1; accepted: true or false");
    EXPECT_EQ(error_of("[hot_end]\nmaximum_celsius = 900\n"),
              "m.toml:2: [hot_end] 'maximum_celsius' is 900; accepted: a number from 30 to 500");
    EXPECT_EQ(error_of("[hot_end]\nkp = \"hot\"\n"),
              "m.toml:2: [hot_end] 'kp' is 'hot'; accepted: a number from 0 to 10000");
    EXPECT_EQ(error_of("fan_pin = 128\n"),
              "m.toml:1: 'fan_pin' is 128; accepted: a whole number from 0 to 127");
    EXPECT_EQ(error_of("axes = 3\n"), "m.toml:1: 'axes' is 3; accepted: a table, [axes]");
    EXPECT_NE(error_of("[axes.x\n").find("m.toml:1: "), std::string::npos);
    EXPECT_EQ(error_of("[axes.y]\nminimum_mm = 5\nmaximum_mm = 5\n"),
              "m.toml:2: 'minimum_mm' is 5, not below maximum_mm, 5");
}

TEST(MachineFile, ADeltaIsPlacedByItsArmsAndSwitches) {
    const std::string delta =
        "[kinematics]\ntype = \"delta\"\ndelta_radius_mm = 105\narm_length_mm = 215\nbed_radius_mm = 90\n";
    const auto parsed =
        parse_machine(delta + "[axes.z]\nmaximum_mm = 260\nhome_position_mm = 250\n", "m.toml");
    ASSERT_TRUE(parsed) << parsed.error().message.view();
    EXPECT_EQ(parsed->axes[Axis::x].minimum, -90_mm);
    EXPECT_NEAR(parsed->axes[Axis::x].home_position.value(), 0, 1e-9);
    EXPECT_NEAR(parsed->axes[Axis::z].home_position.value(), 250, 1e-9);
    EXPECT_FALSE(parsed->axes[Axis::y].home_towards_minimum);
    EXPECT_EQ(error_of("[kinematics]\ntype = \"delta\"\n").find("m.toml:1: [kinematics]"), 0u);
    EXPECT_NE(error_of(delta + "[park]\nx_mm = 80\ny_mm = 80\n").find("bed_radius_mm"), std::string::npos);
    EXPECT_NE(error_of("[kinematics]\ntype = \"delta\"\ndelta_radius_mm = 105\narm_length_mm = 190\n"
                       "bed_radius_mm = 90\n")
                  .find("too short"),
              std::string::npos);
}

TEST(MachineFile, BeltsOfCoreXyAreAlike) {
    EXPECT_NE(error_of("[kinematics]\ntype = \"corexy\"\n[axes.x]\nsteps_per_mm = 100\n").find("belts"),
              std::string::npos);
}

TEST(MachineFile, MoreMotorsOfAnAxisAreListed) {
    const auto parsed = parse_machine(
        "[[axes.z.motors]]\nstep_pin = 30\ndirection_pin = 31\nenable_pin = 32\n"
        "[[axes.z.motors]]\nstep_pin = 33\ndirection_pin = 34\nenable_pin = 35\nendstop_pin = 36\n",
        "m.toml");
    ASSERT_TRUE(parsed) << parsed.error().message.view();
    const auto& motors = parsed->axes[Axis::z].extra_motors;
    ASSERT_EQ(motors.size(), 2u);
    EXPECT_EQ(motors[0].endstop_pin, printer::kNoPin);
    EXPECT_EQ(motors[1].endstop_pin, 36);
}

TEST(MachineFile, AProbeMustReachItsGrid) {
    EXPECT_TRUE(parse_machine("[probe]\npin = 34\n", "m.toml"));
    EXPECT_EQ(error_of("[probe]\npin = 34\nx_offset_mm = 25\n"),
              "m.toml:2: [bed_mesh] the nozzle does not reach X -5, Y 20 to probe there");
    EXPECT_NE(error_of("[probe]\npin = 34\n[bed_mesh]\nfade_start_mm = 5\nfade_end_mm = 5\n"), "");
}

TEST(MachineFile, ShapersAdvanceAndJerk) {
    const auto parsed = parse_machine(
        "jerk_mm_s3 = 100000\nreversal_gap_s = 0.001\n[axes.y.shaper]\ntype = \"2hump_ei\"\n"
        "frequency_hz = 40\n[pressure_advance]\nseconds = 0.05\nsmooth_time_s = 0.03\n",
        "m.toml");
    ASSERT_TRUE(parsed);
    EXPECT_EQ(parsed->jerk_mm_s3, 100'000);
    EXPECT_EQ(parsed->reversal_gap, 1ms);
    EXPECT_FALSE(parsed->axes[Axis::x].shaper.active());
    EXPECT_EQ(parsed->axes[Axis::y].shaper,
              (printer::ShaperConfig{printer::ShaperType::two_hump_ei, 40, 0.1}));
    EXPECT_EQ(parsed->pressure_advance.advance, Seconds{0.05});
    EXPECT_EQ(parsed->pressure_advance.smooth_time, Seconds{0.03});
    EXPECT_EQ(error_of("[axes.x.shaper]\ntype = \"ei\"\n"),
              "m.toml:2: a shaper needs 'frequency_hz', the resonance of its axis");
    EXPECT_EQ(error_of("[axes.x.shaper]\ntype = \"best\"\n"),
              "m.toml:2: [axes.x.shaper] 'type' is 'best'; accepted: \"none\", \"zv\", \"zvd\", \"mzv\", "
              "\"ei\", \"2hump_ei\"");
    EXPECT_NE(error_of("[axes.z.shaper]\ntype = \"ei\"\n"), "");
}

TEST(MachineFile, TheIdleTimeOutIsZeroOrLongEnoughToRead) {
    EXPECT_EQ(parse_machine("", "m.toml")->dialect, std::nullopt);
    EXPECT_EQ(parse_machine("dialect = \"klipper\"\n", "m.toml")->dialect, printer::Dialect::klipper);
    EXPECT_EQ(parse_machine("dialect = \"marlin\"\n", "m.toml")->dialect, printer::Dialect::marlin);
    EXPECT_EQ(error_of("dialect = \"repetier\"\n"),
              "m.toml:1: 'dialect' is 'repetier'; accepted: \"marlin\", \"reprap\", \"klipper\"");
    EXPECT_EQ(parse_machine("", "m.toml")->idle_timeout, Seconds{600});
    EXPECT_EQ(parse_machine("idle_timeout_s = 0\n", "m.toml")->idle_timeout, Seconds{0});
    EXPECT_EQ(parse_machine("idle_timeout_s = 1800\n", "m.toml")->idle_timeout, Seconds{1800});
    EXPECT_EQ(error_of("idle_timeout_s = 5\n"),
              "m.toml:1: 'idle_timeout_s' is 5: give 0 (never) or at least 30 s");
    EXPECT_EQ(error_of("idle_timeout_s = -1\n"),
              "m.toml:1: 'idle_timeout_s' is -1; accepted: a number from 0 to 86400");
    EXPECT_NE(error_of("idle_timeout_s = nan\n"), "");
}

TEST(MachineFile, TheParkPlaceFollowsTheBoundsAndStaysInside) {
    const auto reference = parse_machine("", "m.toml");
    EXPECT_TRUE(reference->park.enabled);
    EXPECT_EQ(reference->park.x, 0_mm);
    EXPECT_EQ(reference->park.y, 150_mm);
    const auto moved = parse_machine(
        "[axes.x]\nminimum_mm = -10\nhome_position_mm = -10\n[axes.y]\nmaximum_mm = 90\n", "m.toml");
    ASSERT_TRUE(moved) << moved.error().message.view();
    EXPECT_EQ(moved->park.x, -10_mm);
    EXPECT_EQ(moved->park.y, 90_mm);
    const auto beyond = parse_machine(
        "[axes.x]\nminimum_mm = -10\n[axes.y]\nmaximum_mm = 90\nhome_position_mm = 80\n"
        "home_towards_minimum = false\n",
        "m.toml");
    ASSERT_TRUE(beyond) << beyond.error().message.view();
    EXPECT_EQ(beyond->park.x, 0_mm) << "the next job could not home from behind the switch";
    EXPECT_EQ(beyond->park.y, 80_mm);
    const auto given = parse_machine(
        "[park]\nenabled = false\nx_mm = 5\nz_hop_mm = 12\nretract_mm = 0\nspeed_mm_s = "
        "40\nretract_speed_mm_s = 9\n",
        "m.toml");
    ASSERT_TRUE(given);
    EXPECT_FALSE(given->park.enabled);
    EXPECT_EQ(given->park.x, 5_mm);
    EXPECT_EQ(given->park.z_hop, 12_mm);
    EXPECT_EQ(error_of("[park]\nx_mm = 200\n"), "m.toml:2: [park] 'x_mm' is 200, outside the axis' 0 to 150");
    EXPECT_EQ(error_of("[park]\nretract_mm = 90\n"),
              "m.toml:2: [park] 'retract_mm' is 90; accepted: a number from 0 to 20");
}

TEST(MachineFile, TheLargestTargetsAre15DegreesBelowTheFault) {
    const auto machine = parse_machine("[bed]\nmaximum_celsius = 100\n", "m.toml");
    ASSERT_TRUE(machine);
    EXPECT_EQ(highest_target(machine->hot_end), 260_celsius);
    EXPECT_EQ(highest_target(machine->bed), 85_celsius);
}

TEST(MachineFile, TheShortestStepIntervalHoldsPulseLowTimeAndBothSidesOfAChangeOfDirection) {
    EXPECT_EQ(step_interval(*parse_machine("", "m.toml")), 2us) << "the set-up passes inside the low time";
    const auto slow_to_turn =
        parse_machine("step_pulse_s = 2e-6\nstep_low_s = 1e-6\ndirection_setup_s = 5e-6\n", "m.toml");
    EXPECT_EQ(step_interval(*slow_to_turn), 10us);
    EXPECT_EQ(step_interval(*parse_machine("step_pulse_s = 3e-6\nstep_low_s = 2.5e-6\n", "m.toml")), 5500ns);
}

TEST(MachineFile, MacrosAreWordsWithTheirLines) {
    const auto machine =
        parse_machine("[macros]\nprint_start = '''\nG28\nM109 S{T}'''\nEND = 'M84'\n", "m.toml");
    ASSERT_TRUE(machine) << machine.error().message.view();
    ASSERT_EQ(machine->macros.size(), 2U);
    EXPECT_EQ(machine->macros[0].name.view(), "END");
    EXPECT_EQ(machine->macros[1].name.view(), "PRINT_START");
    EXPECT_EQ(machine->macros[1].text.view(), "G28\nM109 S{T}");
    EXPECT_EQ(error_of("[macros]\nEND = 5\n"), "m.toml:2: [macros] 'END' is 5; accepted: a text");
    for (const char* name : {"E", "G28X", "T1", "'A B'", "'Ö'"}) {
        const std::string error = error_of("[macros]\n" + std::string(name) + " = 'M84'\n");
        EXPECT_NE(error.find("is no word of 2 to 32 letters"), std::string::npos) << name << ": " << error;
    }
    EXPECT_EQ(error_of("[macros]\n_P2 = 'G1 X{A}{B=2}'\n"), "");
    EXPECT_NE(error_of("[macros]\nPARK = 'G1 X{A} Y{B'\n").find("has a { without its }"), std::string::npos);
    EXPECT_NE(
        error_of("[macros]\nEND = '" + std::string(769, 'x') + "'\n").find("'END' has more than 768 bytes"),
        std::string::npos);
    std::string many = "[macros]\n";
    for (int i = 0; i < 13; ++i) many += "MACRO_" + std::to_string(i) + " = 'M84'\n";
    EXPECT_NE(error_of(many).find("is one macro more than 12"), std::string::npos);
}

TEST(MachineFile, TheStartIsItsTextAndTwoTemperatures) {
    const auto parsed = parse_machine(
        "[start]\ngcode = \"\"\"\nG28\nM109 S{HOT_END}\n\"\"\"\nhot_end_celsius = 215\nbed_celsius = 0\n",
        "m.toml");
    ASSERT_TRUE(parsed) << parsed.error().message.view();
    EXPECT_EQ(parsed->start.text.view(), "G28\nM109 S{HOT_END}\n");
    EXPECT_EQ(parsed->start.hot_end, 215_celsius);
    EXPECT_EQ(parsed->start.bed, 0_celsius);
    const auto reference = parse_machine("", "m.toml");
    EXPECT_EQ(reference->start.text.view(), "") << "made from the machine's numbers";
    EXPECT_EQ(reference->start.hot_end, 200_celsius);
    EXPECT_EQ(reference->start.bed, 60_celsius);
}

TEST(MachineFile, AStartThatDoesNotFitIsRefusedAndNotCut) {
    const auto with_start_of = [](std::size_t bytes) {
        return "[start]\ngcode = '" + std::string(bytes, ';') + "'\n";
    };
    EXPECT_EQ(error_of(with_start_of(768)), "");
    EXPECT_EQ(error_of(with_start_of(769)), "m.toml:2: [start] 'gcode' has more than 768 bytes");
    EXPECT_EQ(error_of("[start]\nlines = 'G28'\n"),
              "m.toml:2: [start] 'lines' is not known; accepted: gcode, hot_end_celsius, bed_celsius");
    EXPECT_EQ(error_of("[start]\nhot_end_celsius = 401\n"),
              "m.toml:2: [start] 'hot_end_celsius' is 401; accepted: a number from 0 to 400");
    EXPECT_EQ(error_of("[start]\nbed_celsius = -1\n"),
              "m.toml:2: [start] 'bed_celsius' is -1; accepted: a number from 0 to 400");
}

TEST(MachineFile, TheFloorOfM302IsNeverAboveTheLimitItself) {
    EXPECT_EQ(parse_machine("", "m.toml")->minimum_extrude_floor, 160_celsius);
    EXPECT_EQ(parse_machine("minimum_extrude_celsius = 120\n", "m.toml")->minimum_extrude_floor, 120_celsius)
        << "what nobody has said goes down with it";
    EXPECT_EQ(parse_machine("minimum_extrude_floor_celsius = 170\n", "m.toml")->minimum_extrude_floor,
              170_celsius);
    EXPECT_EQ(error_of("minimum_extrude_celsius = 180\nminimum_extrude_floor_celsius = 180\n"), "");
    const std::string above =
        error_of("minimum_extrude_celsius = 180\nminimum_extrude_floor_celsius = 181\n");
    EXPECT_EQ(above.substr(0, above.find(": ")), "m.toml:2") << above;
    EXPECT_NE(above.find("is 181, above minimum_extrude_celsius, 180"), std::string::npos) << above;
    EXPECT_EQ(parse_machine("minimum_extrude_floor_celsius = 0\n", "m.toml")->minimum_extrude_floor,
              0_celsius);
}

TEST(MachineFile, AKeyInAnotherUnitIsToldSo) {
    EXPECT_EQ(error_of("[axes.x]\nmax_speed_mm_min = 6000\n"),
              "m.toml:2: [axes.x] 'max_speed_mm_min' is not known: is it 'max_speed_mm_s', in that unit?");
    EXPECT_EQ(error_of("step_pulse_us = 2\n"),
              "m.toml:1: 'step_pulse_us' is not known: is it 'step_pulse_s', "
              "in that unit?");
    EXPECT_EQ(error_of("step_pulse_s = 2\n"),
              "m.toml:1: 'step_pulse_s' is 2; accepted: a number from 0 to 0.001");
}

struct Impossible {
    const char* name;
    const char* text;
    const char* words;
};
class MachineFileRefuses : public testing::TestWithParam<Impossible> {};

TEST_P(MachineFileRefuses, WhatCannotBeWithItsLine) {
    const std::string error = error_of(GetParam().text);
    EXPECT_EQ(error.substr(0, error.find(": ")), "m.toml:2") << error;
    EXPECT_NE(error.find(GetParam().words), std::string::npos) << error;
}
INSTANTIATE_TEST_SUITE_P(
    Rules, MachineFileRefuses,
    testing::Values(
        Impossible{"OnePinTwice", "[bed]\nheater_pin = 17\n", "pin 17 is hot_end.heater_pin already"},
        Impossible{"OneStepPinTwice", "[axes.y]\nstep_pin = 2\n", "pin 2 is axes.x.step_pin already"},
        Impossible{"AnEnableThatSteps", "[axes.y]\nenable_pin = 2\n", "pin 2 is axes.x.step_pin already"},
        Impossible{"OneChannelTwice", "[bed]\nadc_channel = 0\n", "as the hot end's"},
        Impossible{"FasterThanPulses", "[axes.x]\nmax_speed_mm_s = 120\nsteps_per_mm = 6400\n",
                   "500000: at most 78.1 mm/s"},
        Impossible{"HomesBeyondItsOtherEnd", "[axes.x]\nhome_position_mm = 151\n",
                   "beyond the other end of the axis, 150"},
        Impossible{"HomesFasterThanItMoves", "[axes.z]\nhome_speed_mm_s = 6\n", "above max_speed_mm_s, 5"},
        Impossible{"RetreatsOutOfTheAxis", "[axes.x]\nhome_retreat_mm = 30\nmaximum_mm = 20\n",
                   "longer than the axis"},
        Impossible{"TooWeakForItsTarget", "[hot_end.model]\npower_w = 20\n", "heats to 242 °C at most"},
        Impossible{"SensorEndsBelow", "[hot_end]\nmaximum_celsius = 500\n", "more than the sensor can show"},
        Impossible{"NothingCouldBePrinted", "name = 'a'\nminimum_extrude_celsius = 290\n",
                   "nothing could be printed"},
        Impossible{"NearerThanTheWatch", "[bed]\nat_target_celsius = 6\n", "verify_hysteresis_celsius, 5"},
        Impossible{"KeysOfAnotherSensor", "[hot_end.sensor]\nsteinhart_a = 0.001\n", "is not known"},
        Impossible{"NoSuchControl", "[hot_end]\ncontrol = 'bang'\n", "accepted: \"model\", \"pid\""}),
    [](const auto& each) { return each.param.name; });

TEST(MachineFile, GainsWithoutAModelAreUsed) {
    using printer::HeaterControl;
    EXPECT_EQ(parse_machine("", "m.toml")->hot_end.control, HeaterControl::model);
    EXPECT_EQ(parse_machine("[hot_end]\nkp = 20\n", "m.toml")->hot_end.control, HeaterControl::pid);
    EXPECT_EQ(parse_machine("[hot_end]\nkp = 20\ncontrol = 'model'\n", "m.toml")->hot_end.control,
              HeaterControl::model);
    EXPECT_EQ(parse_machine("[hot_end]\nkp = 20\n[hot_end.model]\npower_w = 40\n", "m.toml")->hot_end.control,
              HeaterControl::model);
}

TEST(MachineFile, DriversMayShareAnEnableLine) {
    EXPECT_TRUE(parse_machine("[axes.y]\nenable_pin = 4\n", "m.toml"));
}

TEST(MachineFile, ASensorHasItsTypesKeys) {
    const auto pt1000 = parse_machine("[bed.sensor]\ntype = 'pt1000'\npull_up_ohm = 2200\n", "m.toml");
    ASSERT_TRUE(pt1000) << pt1000.error().message.view();
    EXPECT_EQ(pt1000->bed.sensor.kind, device::SensorKind::pt1000);
    EXPECT_EQ(pt1000->bed.sensor.pull_up_ohm, 2200);
    EXPECT_NE(error_of("[bed.sensor]\ntype = 'steinhart_hart'\n").find("needs 'steinhart_a'"),
              std::string::npos);
}

TEST(MachineFile, WhatM500KeepsIsReadBackToTheBit) {
    printer::MachineConfig found;
    found.hot_end.kp = 31.41592653589793;
    found.hot_end.model.sensor_lag_s = 1.0 / 3;
    found.bed.model.heat_capacity_j_k = 912.345678901234;
    printer::MachineConfig read;
    const std::string text = kept_text(settings_of(found.hot_end), settings_of(found.bed), found.beds);
    ASSERT_TRUE(apply_kept(text, "kept.toml", read));
    EXPECT_EQ(read.hot_end.kp, found.hot_end.kp);
    EXPECT_EQ(read.hot_end.model.sensor_lag_s, found.hot_end.model.sensor_lag_s);
    EXPECT_EQ(read.bed.model.heat_capacity_j_k, found.bed.model.heat_capacity_j_k);
    const printer::MachineConfig file;
    EXPECT_EQ(printer::factory_settings_of(read.hot_end).kp, file.hot_end.kp) << "for M502";
    ASSERT_TRUE(apply_kept(text, "kept.toml", read));
    EXPECT_EQ(printer::factory_settings_of(read.bed).model.heat_capacity_j_k,
              file.bed.model.heat_capacity_j_k)
        << "read twice";
    const auto refused = apply_kept("[hot_end]\nkp = 1\nmaximum_celsius = 400\n", "kept.toml", read);
    ASSERT_FALSE(refused);
    EXPECT_TRUE(refused.error().message.view().starts_with("kept.toml:3: [hot_end] 'maximum_celsius'"));
    EXPECT_EQ(read.hot_end.kp, found.hot_end.kp) << "nothing is changed";
}

TEST(MachineFile, MissingFileIsNamed) {
    const auto parsed = read_machine_file("/nonexistent/m.toml");
    ASSERT_FALSE(parsed);
    EXPECT_NE(parsed.error().message.view().find("/nonexistent/m.toml"), std::string_view::npos);
}

}  // namespace
}  // namespace qduino::apps::machine_file_test
