#include "printer/gcode/emergency_scanner.h"

#include <gtest/gtest.h>

#include <string>

namespace qduino::printer::gcode::emergency_scanner_test {
namespace {

struct Found {
    bool stop = false, break_wait = false, stop_moves = false;
    friend bool operator==(const Found&, const Found&) = default;
};

Found scan(std::string_view bytes, std::size_t chunk) {
    EmergencyScanner scanner;
    Found all;
    for (std::size_t at = 0; at < bytes.size(); at += chunk) {
        const std::string_view piece = bytes.substr(at, chunk);
        const EmergencyCodes found = scanner.feed({piece.data(), piece.size()});
        all.stop |= found.stop;
        all.break_wait |= found.break_wait;
        all.stop_moves |= found.stop_moves;
    }
    return all;
}

TEST(EmergencyScanner, FindsTheThreeCodesHoweverTheyAreCut) {
    for (const std::size_t chunk : {1U, 2U, 5U, 100U}) {
        for (const char* text : {"M112\n", "m112\r", "G1 X1\nM112\n", "  M112 ", "N5 M112*35\n", "M0112\n",
                                 "M 112\n", "M112;now", "N12M112\n", "; G1\nM112\n"}) {
            EXPECT_EQ(scan(text, chunk), (Found{true, false, false})) << text;
        }
        EXPECT_EQ(scan("M108\n", chunk), (Found{false, true, false}));
        EXPECT_EQ(scan("M410\n", chunk), (Found{false, false, true}));
        EXPECT_EQ(scan("M108\nM410\nM112\n", chunk), (Found{true, true, true}));
    }
}

TEST(EmergencyScanner, TextIsNoCommand) {
    for (const char* text :
         {"; M112\n", "M117 M112\n", "G1 M112\n", "M1120\n", "M11\n2\n", "M112", "M112.1\n", "XM112\n",
          "M117 a M112 b\n", "N5 G1 M112\n", "M4294967408\n", "M\n112\n"}) {
        EXPECT_EQ(scan(text, 1), Found{}) << text;
    }
}

}  // namespace
}  // namespace qduino::printer::gcode::emergency_scanner_test
