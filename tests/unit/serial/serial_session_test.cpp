// The words that a serial host hears, and when; and that no noise on the wire loses or doubles a
// line.
#include "serial/serial_session.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/serial/noisy_host.h"

namespace qduino::apps::serial_session_test {
namespace {

using printer::link::ReplyKind;
using tests::NoisyWire;
using tests::numbered;
using tests::PingPongHost;

/// A session and a printer that does nothing of itself.
class Bench {
  public:
    Bench() {
        session.learn(news, now);
        session.open();
        EXPECT_EQ(session.take_output(), "start\n");
    }
    /// What the host hears when it says `bytes`.
    std::string say(const std::string& bytes) {
        session.take(bytes, now);
        return session.take_output();
    }
    /// What it hears `seconds` later.
    std::string after(double seconds) {
        now += from_seconds(seconds);
        session.tick(now);
        return session.take_output();
    }
    /// … and when the printer is done with `lines` more.
    std::string done(std::uint64_t lines = 1) {
        news.lines_over += lines;
        session.learn(news, now);
        return session.take_output();
    }
    /// What has crossed to the printer since the last call, each line behind a `!` if it claims.
    std::string crossed() {
        std::string all;
        for (const HostLine& line : session.take_lines()) all += (line.claims ? "!" : "") + line.text + "\n";
        return all;
    }

    SerialSession session;
    PrinterNews news{.connected = true, .session = 1, .lines_over = 7, .temperatures = "T:20.00 /0.00 @:0"};
    Instant now = instant_from_ns(1'000'000'000);
};

TEST(SerialSession, AMoveIsOkAsSoonAsItIsTaken) {
    Bench b;
    EXPECT_EQ(b.say("G1 X10 F3000 ; right\nG1 X2"), "ok\n");
    EXPECT_EQ(b.say("0\n"), "ok\n");
    EXPECT_EQ(b.crossed(), "!G1 X10 F3000\n!G1 X20\n");
}

TEST(SerialSession, ALineThatAnswersIsOkWhenItHas) {
    Bench b;
    EXPECT_EQ(b.say("M114\nG1 X1\n"), "");
    EXPECT_EQ(b.crossed(), "M114\n") << "the next line waits";
    b.session.hear(ReplyKind::host_text, "X:0.00 Y:0.00");
    EXPECT_EQ(b.done(), "X:0.00 Y:0.00\nok\nok\n");
    EXPECT_EQ(b.crossed(), "!G1 X1\n");
}

TEST(SerialSession, AnswersThatNeedNoPrinterComeAtOnce) {
    Bench b;
    EXPECT_EQ(b.say("M105\n"), "ok T:20.00 /0.00 @:0\n");
    EXPECT_EQ(b.say(numbered(3, "M110")), "ok\n");
    EXPECT_EQ(b.say(numbered(4, "M112")), "ok\n") << "it was found in the bytes";
    EXPECT_EQ(b.say("\n; a comment\n"), "") << "Marlin answers no empty line";
    EXPECT_EQ(b.say(numbered(5, "")), "ok\n");
    EXPECT_EQ(b.crossed(), "");
}

TEST(SerialSession, ADamagedLineIsAskedForAgainAndWhatCameBehindItIsDropped) {
    Bench b;
    EXPECT_EQ(b.say(numbered(1, "G28")), "");
    EXPECT_EQ(b.done(), "ok\n");
    EXPECT_EQ(b.say("N2 G1 X1*0\n" + numbered(3, "G1 X2")),
              "Error:checksum mismatch, Last Line: 1\nResend: 2\nok\n");
    EXPECT_EQ(b.say(numbered(3, "G1 X2")),
              "Error:Line Number is not Last Line Number+1, Last Line: 1\nResend: 2\nok\n");
    EXPECT_EQ(b.say(numbered(2, "G1 X1")), "ok\n");
    EXPECT_EQ(b.crossed(), "!G28\n!G1 X1\n");
}

TEST(SerialSession, ALineThatIsNoGcodeIsAnErrorAndCounts) {
    Bench b;
    const std::string heard = b.say(numbered(1, "G1 X1.2.3"));
    EXPECT_TRUE(heard.starts_with("Error:line 1")) << heard;
    EXPECT_TRUE(heard.ends_with("\nok\n")) << heard;
    EXPECT_EQ(b.say(numbered(2, "G1 X1")), "ok\n");
}

TEST(SerialSession, ALineWithTwoNumbersDoesNotReachThePrinter) {
    Bench b;
    EXPECT_EQ(b.say(numbered(1, "N2 G28")), "Error:two line numbers\nok\n");
    EXPECT_EQ(b.say(numbered(2, "N3")), "Error:two line numbers\nok\n");
    EXPECT_EQ(b.crossed(), "");
}

TEST(SerialSession, NoMoreLinesThanTheWindowAreUnderWay) {
    Bench b;
    std::string many, oks;
    for (std::size_t i = 0; i < printer::link::kHostLinesMax + 2; ++i) many += "G1 X1\n";
    for (std::size_t i = 0; i < printer::link::kHostLinesMax; ++i) oks += "ok\n";
    EXPECT_EQ(b.say(many), oks);
    EXPECT_EQ(b.session.under_way(), printer::link::kHostLinesMax);
    EXPECT_EQ(b.done(), "ok\n");
    EXPECT_EQ(b.done(3), "ok\n");
    EXPECT_EQ(b.session.under_way(), printer::link::kHostLinesMax - 2);
}

TEST(SerialSession, WhileHeatIsWaitedForTheTemperaturesAreSaid) {
    Bench b;
    EXPECT_EQ(b.say("M109 S200\n"), "");
    EXPECT_EQ(b.after(0.9), "");
    EXPECT_EQ(b.after(0.2), " T:20.00 /0.00 @:0\n");
    EXPECT_EQ(b.after(1), " T:20.00 /0.00 @:0\necho:busy: processing\n");
    EXPECT_EQ(b.done(), "ok\n");
    EXPECT_EQ(b.after(5), "");
}

TEST(SerialSession, M113AndM155SetHowOftenItSpeaksByItself) {
    Bench b;
    EXPECT_EQ(b.say("M155 S3\nM113 S1\n"), "ok\nok\n");
    EXPECT_EQ(b.after(2.9), "");
    EXPECT_EQ(b.after(0.2), " T:20.00 /0.00 @:0\n");
    EXPECT_EQ(b.say("M155 S0\nG28\n"), "ok\n");
    EXPECT_EQ(b.after(1.1), "echo:busy: processing\n");
    EXPECT_EQ(b.done(), "ok\n");
}

TEST(SerialSession, RefusalsAndFaultsAreErrors) {
    Bench b;
    EXPECT_EQ(b.say("G28\n"), "");
    b.session.refuse(make_error(ErrorCode::not_permitted, "the printer is printing job 3"));
    EXPECT_EQ(b.session.take_output(), "Error:the printer is printing job 3\nok\n");
    b.session.hear(ReplyKind::host_error, "line 1, G1: X is out");
    b.session.hear(ReplyKind::host_warning, "look");
    EXPECT_EQ(b.session.take_output(), "Error:line 1, G1: X is out\necho:look\n");
    b.news.fault = "hot end: no reading";
    EXPECT_EQ(b.done(0), "Error:Printer halted. hot end: no reading\n");
    EXPECT_EQ(b.done(0), "") << "once";
}

TEST(SerialSession, APrinterThatStartsAnewGreetsAndOwesNothing) {
    Bench b;
    EXPECT_EQ(b.say("G28\n"), "");
    b.news = {.connected = true, .session = 2, .lines_over = 0};
    EXPECT_EQ(b.done(0), "start\n");
    EXPECT_EQ(b.session.under_way(), 0u);
    EXPECT_EQ(b.say(numbered(1, "G1 X1")), "ok\n") << "numbers begin anew";
}

TEST(SerialSession, WithoutAPrinterItSaysSo) {
    Bench b;
    EXPECT_EQ(b.say("G28\n"), "");
    b.news.connected = false;
    EXPECT_EQ(b.done(0), "Error:the printer's program has ended\nok\n");
    EXPECT_EQ(b.say("G28\n"), "Error:the printer's program does not run\nok\n");
}

/// While heat is waited for no line is taken: the host has no `ok`, and sends all the same.
TEST(SerialSession, WhatDoesNotFitBehindALineThatWaitsIsAskedForAgain) {
    Bench b;
    EXPECT_EQ(b.say(numbered(1, "M109 S200")), "");
    std::vector<std::string> lines;
    for (int i = 0; i < 6000; ++i) lines.push_back("G1 X" + std::to_string(i));
    for (std::size_t i = 0; i < lines.size(); ++i)
        EXPECT_EQ(b.say(numbered(static_cast<std::int64_t>(i) + 2, lines[i])), "");
    EXPECT_LE(b.session.held(), HeldLines::kMax);
    EXPECT_EQ(b.crossed(), "!M109 S200\n");
    std::vector<std::string> crossed;
    std::string heard;
    const auto take_all = [&] {
        for (std::size_t lines_over = 1; lines_over > 0;) {
            lines_over = b.session.under_way();
            heard += b.done(lines_over);
            for (const HostLine& line : b.session.take_lines()) crossed.push_back(line.text);
        }
    };
    take_all();
    const std::size_t taken = crossed.size();
    ASSERT_LT(taken, lines.size());
    const std::string next = std::to_string(taken + 2);
    EXPECT_TRUE(heard.ends_with("Error:lines did not fit, and were dropped, Last Line: " +
                                std::to_string(taken + 1) + "\nResend: " + next + "\nok\n"))
        << heard.substr(heard.size() - 200);
    for (std::size_t i = taken; i < lines.size(); ++i) {
        heard += b.say(numbered(static_cast<std::int64_t>(i) + 2, lines[i]));
        if (i % 50 == 0) take_all();
    }
    take_all();
    EXPECT_EQ(crossed, lines);
}

TEST(SerialSession, AHostWithoutNumbersMovesNothingBehindLinesThatWereDropped) {
    Bench b;
    EXPECT_EQ(b.say("M109 S200\n"), "");
    EXPECT_EQ(b.crossed(), "!M109 S200\n");
    for (int i = 0; i < 20'000; ++i) EXPECT_EQ(b.say("G1 X1\n"), "");
    std::string heard;
    for (int i = 0; i < 20'000 && b.session.held() > 0; ++i) {
        heard += b.done(b.session.under_way());
        static_cast<void>(b.crossed());
    }
    heard += b.done(b.session.under_way());
    static_cast<void>(b.crossed());
    EXPECT_NE(heard.find("\nResend: 1\nok\n"), std::string::npos);
    const std::string refusal =
        "Error:lines before this one were dropped: send them again with numbers, or begin anew with "
        "M110\nok\n";
    EXPECT_EQ(b.say("G1 X1\n"), refusal);
    EXPECT_EQ(b.say("M104 S0\n"), "ok\n") << "heat can be switched off";
    EXPECT_EQ(b.say("G1 X2\n"), refusal);
    EXPECT_EQ(b.crossed(), "M104 S0\n");
    EXPECT_EQ(b.say("M110\nG1 X3\n"), "ok\nok\n");
    EXPECT_EQ(b.crossed(), "!G1 X3\n");
}

TEST(SerialSession, AFloodOfEmergencyCodesIsOneLine) {
    Bench b;
    for (int i = 0; i < 1000; ++i) b.session.send_at_once("M410");
    b.session.send_at_once("M108");
    EXPECT_EQ(b.session.under_way(), 2u);
    EXPECT_EQ(b.crossed(), "M108\nM410\n");
}

TEST(SerialSession, AnEmergencyCodeOvertakesTheLinesAndIsCounted) {
    Bench b;
    EXPECT_EQ(b.say("G1 X1\n"), "ok\n");
    b.session.send_at_once("M410");
    EXPECT_EQ(b.session.under_way(), 2u);
    EXPECT_EQ(b.crossed(), "M410\n!G1 X1\n");
}

// ---- noise --------------------------------------------------------------------------------------

class SerialNoise : public testing::TestWithParam<int> {};

TEST_P(SerialNoise, EachLineCrossesOnceAndInOrder) {
    const auto seed = static_cast<std::uint64_t>(GetParam());
    std::mt19937_64 random{seed};
    NoisyWire to_printer{seed * 2 + 1, 0.15}, to_host{seed * 2 + 2, 0.15};
    std::vector<std::string> lines;
    for (int i = 0; i < 300; ++i) {
        lines.push_back(random() % 8 == 0
                            ? "M400"
                            : "G1 X" + std::to_string(random() % 200) + "." +
                                  std::to_string(random() % 1000) + " E" + std::to_string(i % 10));
    }
    PingPongHost host{lines};
    Bench b;
    std::vector<std::string> crossed;
    for (int step = 0; step < 100'000 && crossed.size() < lines.size(); ++step) {
        std::string heard = b.say(to_printer.carry(host.speak()));
        for (const HostLine& line : b.session.take_lines()) crossed.push_back(line.text);
        if (random() % 3 == 0) heard += b.done(b.session.under_way());
        host.hear(to_host.carry_lines(heard));
    }
    EXPECT_EQ(crossed, lines) << "seed " << seed;
}
INSTANTIATE_TEST_SUITE_P(Seeds, SerialNoise, testing::Range(0, 40));

}  // namespace
}  // namespace qduino::apps::serial_session_test
