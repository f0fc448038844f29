// What breaks in the heat, how long until the printer has seen it and the heaters are off, and how
// hot the block truly became. The table is printed; the limits are asserted. Times are virtual, on
// the twin's own numbers.
#include <gtest/gtest.h>

#include "tests/scenario/printer/printer_bench.h"

namespace qduino::tests::heat_faults_test {
namespace {

using link::MachineState;

struct Case {
    const char* name;
    const char* fault;   ///< at `at_s`
    const char* before;  ///< the job
    double at_s;
    const char* words;      ///< of the fault
    double within_s;        ///< of the fault
    double never_above;     ///< true block temperature, until a minute later
    bool heats_on = false;  ///< the switch is stuck: the pin is off, and the power is not
};

class HeatFault : public testing::TestWithParam<Case> {};

/// Its heat stays on when it is over.
constexpr const char* kHeating = "M109 S205\n";
constexpr const char* kIdle = "";  // no job
constexpr double kHeld = 260;      // by then M109 S205 is over, and its heater holds

TEST_P(HeatFault, CutsTheHeatAndSaysWhatToDo) {
    const Case& broken = GetParam();
    PrinterBench bench(printer::MachineConfig{}, twin::Machine{});
    ASSERT_TRUE(bench.begin());
    const std::size_t heater = std::string_view{broken.fault}.ends_with(":bed") ? twin::kBed : twin::kHotEnd;
    if (*broken.before != '\0') bench.job(broken.before);
    bench.run(broken.at_s);
    ASSERT_TRUE(bench.fault().empty()) << bench.fault();
    twin::Fault fault = *twin::parse_fault(broken.fault);
    fault.at = bench.now();
    bench.twin().inject(fault);
    double highest = 0;
    const auto look = [&] { highest = std::max(highest, bench.metal().block_celsius[heater]); };
    // In steps of a sample: some faults are seen within four.
    bool seen = false;
    while (!seen && to_seconds(bench.now() - fault.at) < broken.within_s + 1) {
        bench.printer().run(bench.now() + 8ms);
        look();
        seen = !bench.heat().fault.empty();
    }
    const double seen_s = to_seconds(bench.now() - fault.at);
    const double true_celsius = bench.metal().block_celsius[heater];
    bench.run(1);
    const std::string words = bench.fault();
    EXPECT_EQ(bench.metal().heater_duty[twin::kHotEnd], 0.0);
    EXPECT_EQ(bench.metal().heater_duty[twin::kBed], 0.0);
    EXPECT_EQ(bench.status().state, MachineState::faulted);
    for (int second = 0; second < 60 && !broken.heats_on; ++second) {
        bench.run(1);
        look();
    }
    std::printf("| %-34s | %8.3f s | %5.0f C | %5.0f C | %s |\n", broken.name, seen_s, true_celsius, highest,
                words.c_str());
    EXPECT_TRUE(seen) << "not noticed";
    EXPECT_LE(seen_s, broken.within_s);
    EXPECT_LE(highest, broken.never_above);
    EXPECT_NE(words.find(broken.words), std::string::npos) << words;
    EXPECT_NE(words.find("heat is off; "), std::string::npos) << "no advice: " << words;
}

INSTANTIATE_TEST_SUITE_P(
    Table, HeatFault,
    testing::Values(
        Case{"SensorOpenWhileHeating", "sensor_open:hot_end", kHeating, 60, "sensor does not answer", 0.05,
             140},
        Case{"SensorOpenWhileHolding", "sensor_open:hot_end", kHeating, kHeld, "sensor does not answer", 0.05,
             206},
        Case{"SensorShort", "sensor_short:hot_end", kHeating, kHeld, "sensor does not answer", 0.05, 206},
        Case{"SensorFrozenWhileHeating", "sensor_stuck:hot_end", kHeating, 60, "does not heat up", 22, 170},
        Case{"SensorDriftsWhileHolding", "sensor_drifts:hot_end", kHeating, kHeld, "than its power explains",
             90, 260},
        Case{"BedSensorOpen", "sensor_open:bed", "M190 S60\n", 100, "bed sensor", 0.05, 60},
        Case{"BusSilent", "bus_silent", kHeating, kHeld, "does not answer", 0.05, 206},
        Case{"HeaterDeadWhileHeating", "heater_disconnected:hot_end", kHeating, 60, "does not heat up", 25,
             130},
        Case{"HeaterDeadWhileHolding", "heater_disconnected:hot_end", kHeating, kHeld, "", 40, 206},
        Case{"BedHeaterDead", "heater_disconnected:bed", "M190 S60\n", 100, "bed ", 65, 60},
        Case{"HeaterStuckOnWhileIdle", "heater_stuck_on:hot_end", kIdle, 30, "cut the power", 45, 90, true},
        Case{"HeaterStuckOnWhileHolding", "heater_stuck_on:hot_end", kHeating, kHeld, "cut the power", 45,
             270, true},
        Case{"BedStuckOn", "heater_stuck_on:bed", kIdle, 30, "cut the power", 85, 45, true}),
    [](const auto& each) { return each.param.name; });

/// Only what depends on the reading can tell that it stands still. At the target nothing does.
TEST(HeatFaults, ASensorThatFreezesAtItsTargetIsHarmlessUntilTheNextTarget) {
    PrinterBench bench(printer::MachineConfig{}, twin::Machine{});
    ASSERT_TRUE(bench.begin());
    bench.type("M109 S205");
    bench.run(kHeld);
    bench.twin().inject(*twin::parse_fault("sensor_stuck:hot_end"));
    double highest = 0;
    const auto run = [&](double seconds) {
        for (double second = 0; second < seconds; ++second) {
            bench.run(1);
            highest = std::max(highest, bench.metal().block_celsius[twin::kHotEnd]);
        }
    };
    run(200);
    bench.type("M106 S255");
    run(120);
    bench.type("M104 S215");
    run(120);
    std::printf("| frozen at its target, then M109 S215: highest %.0f C, %s |\n", highest,
                bench.fault().c_str());
    EXPECT_NE(bench.fault().find("heat is off; "), std::string::npos) << bench.fault();
    EXPECT_LT(highest, 250);
}

}  // namespace
}  // namespace qduino::tests::heat_faults_test
