#include "printer/gcode/host_session.h"

#include <gtest/gtest.h>

#include <string>

namespace qduino::printer::gcode::host_session_test {
namespace {

std::string summed(const std::string& line) {
    unsigned sum = 0;
    for (const char c : line) sum ^= static_cast<unsigned char>(c);
    return line + "*" + std::to_string(sum) + "\n";
}

class Session {
  public:
    /// The session's reply to one line; "accepted" when it has none.
    std::string say(const std::string& text) {
        std::span<const char> input{text.data(), text.size()};
        const HostVerdict verdict = session.accept(*parser.next(input));
        return verdict.accepted ? "accepted" : std::string(verdict.reply.view());
    }
    Parser parser;
    HostSession session;
};

TEST(HostSession, NumbersMustFollowEachOther) {
    Session s;
    EXPECT_EQ(s.say(summed("N0 M110 N0")), "accepted");
    EXPECT_EQ(s.say(summed("N1 G28")), "accepted");
    EXPECT_EQ(s.say(summed("N2 G1 X10")), "accepted");
    EXPECT_EQ(s.say(summed("N4 G1 X30")),
              "Error:Line Number is not Last Line Number+1, Last Line: 2\nResend: 3\nok");
    EXPECT_EQ(s.say(summed("N2 G1 X10")),
              "Error:Line Number is not Last Line Number+1, Last Line: 2\nResend: 3\nok");
    EXPECT_EQ(s.say(summed("N3 G1 X20")), "accepted");
}

TEST(HostSession, CheckSumsMustBeThereAndRight) {
    Session s;
    EXPECT_EQ(s.say(summed("N1 G28")), "accepted");
    EXPECT_EQ(s.say("N2 G1 X10*1\n"), "Error:checksum mismatch, Last Line: 1\nResend: 2\nok");
    EXPECT_EQ(s.say("N2 G1 X10\n"), "Error:No Checksum with line number, Last Line: 1\nResend: 2\nok");
    EXPECT_EQ(s.say(summed("N2 G1 X10")), "accepted");
}

TEST(HostSession, ALineWithoutNumberPasses) {
    Session s;
    EXPECT_EQ(s.say("M105\n"), "accepted");
    EXPECT_EQ(s.say(summed("N1 G28")), "accepted") << "and has no number";
}

TEST(HostSession, M110SetsTheNumber) {
    Session s;
    EXPECT_EQ(s.say(summed("N7 M110 N99")), "accepted");
    EXPECT_EQ(s.say(summed("N100 G28")), "accepted");
    EXPECT_EQ(s.say(summed("N50 M110")), "accepted");
    EXPECT_EQ(s.say(summed("N51 G28")), "accepted");
    EXPECT_EQ(s.say(summed("N5 M110 N-3")), "accepted");
    EXPECT_EQ(s.say(summed("N-2 G28")), "accepted");
    // Printrun's first line, and the one behind it.
    EXPECT_EQ(s.say("N-1 M110*15\n"), "accepted");
    EXPECT_EQ(s.say(summed("N0 G28")), "accepted");
}

TEST(HostSession, ALineThatLostItsNumberIsAskedForAgain) {
    Session s;
    EXPECT_EQ(s.say(summed("N1 G28")), "accepted");
    EXPECT_EQ(s.say("G1 X10 E5*97\n"), "Error:No Line Number with checksum, Last Line: 1\nResend: 2\nok");
    EXPECT_EQ(s.say("2 G1 X10*97\n"), "Error:No Line Number with checksum, Last Line: 1\nResend: 2\nok");
    EXPECT_EQ(s.say("M117 a*b\n"), "accepted");
    EXPECT_EQ(s.say(summed("N2 G28")), "accepted");
}

}  // namespace
}  // namespace qduino::printer::gcode::host_session_test
