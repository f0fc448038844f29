#include "config/macro_check.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "config/machine_file.h"

namespace qduino::apps::macro_check_test {
namespace {

std::string errors_of(const std::string& macros) {
    printer::MachineConfig machine;
    EXPECT_EQ(machine_error("[macros]\n" + macros, "m.toml", machine), "");
    return macro_errors(machine);
}

TEST(MacroCheck, TakesWhatAJobCouldCarryOut) {
    EXPECT_EQ(
        errors_of(
            "PRINT_START = '''\nG28 ; home\nM190 S{BED_TEMP=60}\n\nM109 S{EXTRUDER_TEMP}\nM117 hello'''\n"
            "PRINT_END = '''M104 S0\nG1 E-{length}'''\n"),
        "");
    EXPECT_EQ(errors_of("LAMP = 'M9999'\n"), "") << "an M code that is not known is skipped";
}

TEST(MacroCheck, NamesEachLineThatNoJobCould) {
    const std::string found = errors_of(
        "START = '''G28\nG999\nLOAD_IT'''\nOTHER = 'START'\nTOOL = 'M104 S{A}{B}0.5.5'\nEND = 'G28'\n");
    for (const char* line : {"macro START, line 2, G999: ", "macro START, line 3, LOAD_IT: ",
                             "macro OTHER, line 1, START: a macro calls no macro", "macro TOOL, line 1, "})
        EXPECT_NE(found.find(line), std::string::npos) << line << " in\n" << found;
    EXPECT_EQ(std::ranges::count(found, '\n'), 4) << found;
}

TEST(MacroCheck, NamesEachLineOfTheStartThatNoJobCould) {
    const auto errors_of_start = [](const std::string& text, const std::string& more = "") {
        printer::MachineConfig machine;
        EXPECT_EQ(machine_error("[start]\ngcode = '''" + text + "'''\n" + more, "m.toml", machine), "");
        return macro_errors(machine);
    };
    EXPECT_EQ(errors_of_start("G28\nM190 S{BED}\nM109 S{HOT_END} ; hot\n"), "");
    EXPECT_EQ(errors_of_start("WARM\n", "[macros]\nWARM = 'G28'\n"), "") << "a job may call a macro";
    EXPECT_NE(errors_of_start("G28\nWARM\nG999\n").find("[start] gcode, line 2, WARM: "), std::string::npos);
    EXPECT_NE(errors_of_start("G28\nWARM\nG999\n").find("[start] gcode, line 3, G999: "), std::string::npos);
    EXPECT_NE(errors_of_start("M109 S{EXTRUDER}").find("needs EXTRUDER"), std::string::npos)
        << errors_of_start("M109 S{EXTRUDER}");
    EXPECT_NE(errors_of_start("M109 S{HOT_END").find("[start] gcode"), std::string::npos);
}

}  // namespace
}  // namespace qduino::apps::macro_check_test
