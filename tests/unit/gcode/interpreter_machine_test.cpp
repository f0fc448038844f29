// Heaters, fans, limits, messages, pauses: a program in, the actions it asks for out.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <vector>

#include "recorder.h"

namespace qduino::printer::gcode::interpreter_machine_test {
namespace {

using Log = std::vector<std::string>;

struct Case {
    const char* program;
    Log expected;
};

void check(const std::vector<Case>& cases) {
    for (const Case& c : cases) {
        Bench bench;
        EXPECT_EQ(bench.run(c.program), c.expected) << c.program;
    }
}

TEST(InterpreterMachine, M302SetsTheLimitOfAJobAndNeverBelowTheFloor) {
    const std::string told = "echo line 2: Cold extrudes are disabled (min temp ";
    const auto floor = [](const char* asked) {
        return std::string{"warning line 1: M302: filament moves from 160 °C on, and not from "} + asked +
               " °C (minimum_extrude_floor_celsius of the machine file)";
    };
    check({
        {"M302\n", {"echo line 1: Cold extrudes are disabled (min temp 170C)"}},
        {"M302 S165\nM302\n", {"limits extrude165", told + "165C)"}},
        {"M302 S180\nM302\n", {"limits extrude180", told + "180C)"}},
        {"M302 S0\nM302\n", {floor("0"), "limits extrude160", told + "160C)"}},
        {"M302 P1\nM302\n", {"limits extrude160", told + "160C)"}},
        {"M302 P0\nM302\n", {"limits extrude170", told + "170C)"}},
    });
    MachineConfig clay;
    clay.minimum_extrude = 0_celsius;
    EXPECT_EQ(Bench{clay}.run("M302\n"), Log{"echo line 1: Cold extrudes are enabled (min temp 0C)"});
}

TEST(InterpreterMachine, ABedIsProbedByAMachineThatHasAProbeAndIsHomed) {
    const Log skipped = Bench{}.run("G28\nG29\n");
    ASSERT_EQ(skipped.size(), 2u);
    EXPECT_NE(skipped[1].find("G29 (probe the bed mesh) is not done by this printer"), std::string::npos);
    MachineConfig machine;
    machine.probe.pin = 34;
    EXPECT_EQ(Bench{machine}.run("G80\n"), Log{"error: line 1, G80: home first (G28)"});
    // Rows go to and fro: the last of five ends at the far corner.
    EXPECT_EQ(Bench{machine}.run("G28\nG29\nG91\nG1 Z-1 F600\nG90\nG1 X120 F600\n"),
              (Log{"home XYZ", "probe bed", "travel Z4 at 10", "travel X120 at 10"}));
    EXPECT_EQ(Bench{machine}.run("G28\nBED_MESH_CALIBRATE PROFILE=x\n"), (Log{"home XYZ", "probe bed"}));
}

TEST(InterpreterMachine, ABedIsFollowedFadedAndNamed) {
    check({
        {"M420 S1 Z10\n", {"bed follow fade 10"}},
        {"M420 S0\n", {"bed plane"}},
        {"M420 V\n", {"bed"}},
        {"G20\nM420 Z1\n", {"bed fade 25.4"}},
        {"M420 Z-1\n", {"error: line 1, M420: Z-1 is outside of 0 to 1000 mm"}},
        {"BED_MESH_CLEAR\n", {"bed plane forget"}},
    });
    MachineConfig machine;
    machine.probe.pin = 50;
    for (const Case& c :
         std::vector<Case>{{"BED_MESH_PROFILE LOAD=default\n", {"bed follow load default"}},
                           {"BED_MESH_PROFILE SAVE=\"a b\"\n", {"bed save a b"}},
                           {"BED_MESH_PROFILE REMOVE=x\n", {"bed remove x"}},
                           {"BED_MESH_PROFILE\n",
                            {"error: line 1, BED_MESH_PROFILE: needs LOAD, SAVE or REMOVE, and a name"}}}) {
        EXPECT_EQ(Bench{machine}.run(c.program), c.expected) << c.program;
    }
}

TEST(InterpreterMachine, SkewIsGivenByTangentsOrByASquare) {
    check({
        {"M852\n", {}},
        {"M852 I0.01 J-0.02\nM852 K0.03\n", {"bed 0.01 -0.02 0", "bed 0.01 -0.02 0.03"}},
        {"M852 S0.005\n", {"bed 0.005 0 0"}},
        {"M852 I0.3\n", {"error: line 1, M852: I0.3 is outside of -0.2 to 0.2 (a tangent)"}},
        {"M852 I0.1\nSET_SKEW CLEAR=1\n", {"bed 0.1 0 0", "bed 0 0 0"}},
        {"SET_SKEW XY=1,2\n", {"error: line 1, SET_SKEW: give AC,BD,AD, three lengths"}},
        {"SET_SKEW XY=100,140,99\n", {"error: line 1, SET_SKEW: these lengths are of no square"}},
    });
    // A parallelogram of sides 100 and 100 whose angle at A lacks atan(0.02) of 90 degrees.
    const double angle = std::atan(0.02), ac = 200 * std::cos((std::numbers::pi / 2 - angle) / 2),
                 bd = 200 * std::sin((std::numbers::pi / 2 - angle) / 2);
    char line[80];
    std::snprintf(line, sizeof line, "SET_SKEW XY=%.12f,%.12f,100\n", ac, bd);
    const Log log = Bench{}.run(line);
    ASSERT_EQ(log.size(), 1u);
    EXPECT_NEAR(std::stod(log[0].substr(4)), 0.02, 1e-6) << log[0];
}

TEST(InterpreterMachine, ADeltaKeepsToItsBedAndHomesAsAWhole) {
    MachineConfig machine;
    machine.kinematics = {.type = KinematicsType::delta,
                          .delta_radius = 105_mm,
                          .arm_length = 215_mm,
                          .home_height = 250_mm,
                          .bed_radius = 90_mm};
    for (const Axis axis : {Axis::x, Axis::y}) machine.axes[axis].minimum = Millimetres{-90};
    machine.axes[Axis::z].maximum = 260_mm;
    place_delta_home(machine);
    EXPECT_EQ(Bench{machine}.run("G28 X\n"), Log{"home XYZ"});
    const Log outside = Bench{machine}.run("G28\nG1 X70 Y70 Z50 F600\n");
    EXPECT_NE(outside.back().find("this machine reaches 90 mm around X 0, Y 0"), std::string::npos)
        << outside.back();
    const Log above = Bench{machine}.run("G28\nG1 X80 F600\n");
    EXPECT_NE(above.back().find("a carriage above its switch"), std::string::npos) << above.back();
    EXPECT_EQ(Bench{machine}.run("G28\nG1 Z100 F600\nG1 X80\n").size(), 3u);
    EXPECT_EQ(Bench{machine}.run("G28\nM84 X\n").back(), "off X");
}

TEST(InterpreterMachine, NumbersOfTheHeaters) {
    check({
        {"M301 P22.2 I1.08\n", {"settings of hot end, kp 22.2, ki 1.08"}},
        {"M304 D305\n", {"settings of bed, kd 305"}},
        {"M306 P60 C18 R0.5 A0.1 F0.12\n",
         {"settings of hot end, power 60, capacity 18, lag 2, loss 0.1, loss with fan 0.12"}},
        {"M306 E-1 C500\n", {"settings of bed, capacity 500"}},
        {"M301\n", {"report settings 3"}},
        {"M304\n", {"report settings 4"}},
        {"M306\n", {"report settings 5"}},
        {"M306 E-1\n", {"report settings 6"}},
        {"M503\n", {"report settings 7"}},
        {"M303\n", {"tune hot end gains at 150, 5 swings"}},
        {"M303 E-1 S60 C8 U1\n", {"tune bed gains at 60, 8 swings, use"}},
        {"M306 P50 T\n", {"settings of hot end, power 50", "tune hot end model at 200, 5 swings, use"}},
        {"M500\n", {"keep settings"}},
        {"M501\n", {"restore settings"}},
        {"M502\n", {"factory settings"}},
    });
}

TEST(InterpreterMachine, NumbersThatNoHeaterHasAreRefused) {
    for (const char* line : {"M301 P-1\n", "M306 C0\n", "M306 R0\n", "M306 A0\n", "M303 S400\n", "M303 S20\n",
                             "M303 C2\n", "M303 E1\n", "M306 T S300\n"}) {
        const Log log = Bench{}.run(line);
        ASSERT_EQ(log.size(), 1u) << line;
        EXPECT_TRUE(log[0].starts_with("error")) << line << log[0];
    }
    MachineConfig bare;
    bare.has_bed = false;
    EXPECT_TRUE(Bench{bare}.run("M304 P1\n")[0].find("no heated bed") != std::string::npos);
}

TEST(InterpreterMachine, Temperatures) {
    check({
        {"M104 S209\n", {"set hot end 209"}},
        {"M104 S0\n", {"set hot end 0"}},
        {"M104 T0 S200.5\n", {"set hot end 200.5"}},
        {"M109 S215\n", {"wait hot end 215 heating"}},
        {"M109 R180\n", {"wait hot end 180 either way"}},
        {"M104 S215\nM109\n", {"set hot end 215", "wait hot end 215 heating"}},
        {"M140 S60\nM190\n", {"set bed 60", "wait bed 60 heating"}},
        {"M109\nM190\n", {}},
        {"M104\n", {"error: line 1, M104: needs S or R, a temperature"}},
        {"M140 S60\n", {"set bed 60"}},
        {"M190 S60\n", {"wait bed 60 heating"}},
        {"M190 R40\n", {"wait bed 40 either way"}},
        {"M104 S260\n", {"set hot end 260"}},
        {"M140 S110\n", {"set bed 110"}},
    });
}

TEST(InterpreterMachine, TemperaturesOutOfRangeNameTheLimit) {
    check({
        {"M104 S999\n", {"error: line 1, M104: S999 is outside of 0 to 260 °C, what the hot end may have"}},
        {"M109 S261\n", {"error: line 1, M109: S261 is outside of 0 to 260 °C, what the hot end may have"}},
        {"M109 R-1\n", {"error: line 1, M109: R-1 is outside of 0 to 260 °C, what the hot end may have"}},
        {"M140 S111\n", {"error: line 1, M140: S111 is outside of 0 to 110 °C, what the bed may have"}},
        {"M190 S1000\n", {"error: line 1, M190: S1000 is outside of 0 to 110 °C, what the bed may have"}},
        {"M104\n", {"error: line 1, M104: needs S or R, a temperature"}},
        {"M104 S\n", {"error: line 1, M104: S needs a number behind it"}},
        {"M104 S200 T1\n", {"error: line 1, M104: this machine has one tool, T0"}},
    });
}

TEST(InterpreterMachine, WithoutABedOnlyOffIsAccepted) {
    MachineConfig config;
    config.has_bed = false;
    Bench bench{config};
    EXPECT_EQ(bench.run("M140 S0\nM190 S0\n"), Log{});
    EXPECT_EQ(bench.run("M140 S60\n"), Log{"error: line 1, M140: this machine has no heated bed"});
}

TEST(InterpreterMachine, Fans) {
    check({
        {"M106 S255\n", {"fan 0 1"}},
        {"M106 S127.5\n", {"fan 0 0.5"}},
        {"M106\n", {"fan 0 1"}},
        {"M106 S0\n", {"fan 0 0"}},
        {"M106 P1 S255\n", {"fan 1 1"}},
        {"M107\n", {"fan 0 0"}},
        {"M107 P2\n", {"fan 2 0"}},
        {"M106 S256\n", {"error: line 1, M106: S256 is outside of 0 to 255"}},
        {"M106 S-1\n", {"error: line 1, M106: S-1 is outside of 0 to 255"}},
        {"M106 P999\n", {"error: line 1, M106: P999 is outside of 0 to 255 (the fan's number)"}},
    });
}

TEST(InterpreterMachine, MotorsOff) {
    check({
        {"M84\n", {"off XYZE"}},
        {"M18\n", {"off XYZE"}},
        {"M84 X Y E\n", {"off XYE"}},
        {"M84 S60\n", {"off after 60"}},
        {"M18 S0 X\n", {"off after 0"}},
    });
    Bench bench;
    (void)bench.run("G28\nM84 X Y E\n");
    EXPECT_FALSE(bench.interpreter.homed(Axis::x));
    EXPECT_TRUE(bench.interpreter.homed(Axis::z));
}

TEST(InterpreterMachine, Limits) {
    check({
        {"M201 X1000 Y1000 Z20 E5000\n", {"limits aX1000 aY1000 aZ20 aE5000"}},
        {"M203 X100 Z4.5\n", {"limits vX100 vZ4.5"}},
        {"M204 P800 R1500 T1200\n", {"limits print800 filament1500 travel1200"}},
        {"M204 S1000\n", {"limits print1000 travel1000"}},
        {"M205 X8 Y8 Z.4 E1.5\n", {"limits jX8 jY8 jZ0.4 jE1.5"}},
        {"M205 J0.02\n", {"limits deviation0.02"}},
        {"M205 X0\n", {"limits jX0"}},
        {"G20\nM203 X1\n", {"limits vX25.4"}},
        {"M201 X0\n", {"error: line 1, M201: X0 is outside of 0.1 to 2000 mm/s²"}},
        {"M203 X100 Y-1\n", {"error: line 1, M203: Y-1 is outside of 0.001 to 125 mm/s"}},
        {"M204 P0\n", {"error: line 1, M204: P0 is outside of 0.1 to 1000000 mm/s²"}},
        {"M205 J1\n", {"error: line 1, M205: J1 is outside of 0 to 0.5 mm"}},
    });
}

TEST(InterpreterMachine, AJobCannotMakeTheMachineFasterThanItIs) {
    check({
        {"M203 X500 Y100 E200\n",
         {"warning line 1: M203 X kept at 125 E kept at 14: this machine does no more",
          "limits vX125 vY100 vE14"}},
        {"M201 Z9000\n", {"warning line 1: M201 Z kept at 30: this machine does no more", "limits aZ30"}},
        {"M205 X99\n", {"warning line 1: M205 X kept at 20: this machine does no more", "limits jX20"}},
    });
}

TEST(InterpreterMachine, MessagesProgressAndReports) {
    check({
        {"M117 Printing 5%\n", {"message [Printing 5%]"}},
        {"M117\n", {"message []"}},
        {"M118 hello\n", {"echo line 1: hello"}},
        {"M73 P50 R12\n", {"progress 50% 720s"}},
        {"M73 R0\n", {"progress 0s"}},
        {"M73\n", {"report progress"}},
        // A display fails no job: what makes no sense is not shown.
        {"M73 P101\n", {"progress 100%"}},
        {"M73 P-1 R3.5\n", {"progress 0% 210s"}},
        {"M73 P50 R99999999999\n", {"progress 50%"}},
        {"M73 R-1\n", {}},
        {"M73 P R\n", {}},
        {"M73 P??\n", {}},
        {"M73 P5 P6 = half\n", {}},
        {"M105 now?\n", {"report temperatures"}},
        {"M155 S?\n", {}},
        {"M105\nM114\nM115\n", {"report temperatures", "report position", "report firmware"}},
        {"M115 U3.9.1\n", {}},
        {"M115 u6.0.4+14924\n", {}},
        {"M110 N5\n", {}},
        {"M112\n", {"emergency stop"}},
    });
}

TEST(InterpreterMachine, Pauses) {
    check({
        {"M0\n", {"pause []"}},
        {"M1 Change the plate\n", {"pause [Change the plate]"}},
        {"M0 S10\n", {"dwell 10"}},
        {"M0 P500\n", {"dwell 0.5"}},
        {"M0 Stop here\n", {"pause [Stop here]"}},
        {"M0 S-5\n", {"pause [S-5]"}},
        {"M0 S999999\n", {"error: line 1, M0: S999999 is outside of 0 to 86400 s"}},
        {"M600\n", {"filament change []"}},
        {"M601\n", {"pause []"}},
    });
}

TEST(InterpreterMachine, RefusalsAreHandedOn) {
    for (const char* line : {"M104 S200", "M109 S200", "M106", "M107", "M84", "M201 X1", "M203 X1", "M204 S1",
                             "M205 X1", "G4 S1", "G28", "M0", "M600", "M601", "M400"}) {
        Bench bench;
        bench.recorder.refuse_after = 0;
        const Log log = bench.run(std::string(line) + "\n");
        ASSERT_EQ(log.size(), 1U) << line;
        EXPECT_NE(log[0].find("the machine refuses"), std::string::npos) << line;
    }
}

}  // namespace
}  // namespace qduino::printer::gcode::interpreter_machine_test
