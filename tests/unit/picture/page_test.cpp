#include "report/picture/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "report/picture/recorder.h"
#include "report/picture/svg.h"

namespace qduino::apps::picture::page_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Escaped, EveryTextIsTextInXml) {
    EXPECT_EQ(escaped("a<b>&\"'"), "a&lt;b&gt;&amp;&quot;&#39;");
    EXPECT_EQ(escaped("a\x01\n\x7f"), "a???");
    EXPECT_EQ(escaped("Grüße 😀"), "Grüße 😀");
    EXPECT_EQ(escaped("\xff\xc3"), "??");
    EXPECT_EQ(escaped("\xc0\xaf"), "??") << "overlong";
    EXPECT_EQ(escaped("\xed\xa0\x80"), "???") << "a surrogate";
    EXPECT_EQ(escaped("\xef\xbf\xbf"), "???") << "U+FFFF";
}

TEST(Shortened, CountsCharacters) {
    EXPECT_EQ(shortened("loop 1", 6), "loop 1");
    EXPECT_EQ(shortened("loop 12", 6), "loop …");
    EXPECT_EQ(shortened("äöüäöü", 6), "äöüäöü");
    EXPECT_EQ(shortened("äöüäöüä", 6), "äöüäö…");
    EXPECT_EQ(shortened("", 6), "");
}

Schedule one_row(std::size_t stretches) {
    Recorder recorder(kEpoch, kEpoch + 1s);
    recorder.declare({1, 1ms, 2ms, 0}, false);
    const Nanoseconds step = Nanoseconds{500ms} / static_cast<std::int64_t>(stretches);
    for (std::size_t i = 0; i < stretches; ++i) {
        const Instant now = kEpoch + 2 * static_cast<std::int64_t>(i) * step;
        recorder.does(0, 1, Doing::runs, now, 1ms);
        recorder.does(0, 1, Doing::nothing, now + step, 0ms);
    }
    return recorder.finish(kEpoch + 1s);
}

TEST(Page, NamesAreEscapedAndShortened) {
    Schedule schedule = one_row(3);
    schedule.title = "<script>&" + std::string(200, 'x');
    schedule.cores[0].rows[0].name = "a \"name\" that is much longer than its column";
    schedule.cores[0].taken.push_back({kEpoch, kEpoch + 1ms, "eth0 <rx>"});
    const std::string page = svg_page(schedule);
    EXPECT_THAT(page, Not(HasSubstr("<script>")));
    EXPECT_THAT(page, HasSubstr("&lt;script&gt;&amp;xxx"));
    EXPECT_THAT(page, HasSubstr("a &quot;name&quot; that is mu…</text>"));
    EXPECT_THAT(page, HasSubstr("eth0 &lt;rx&gt; takes 1 ms at 0 ns"));
}

TEST(Page, TheTriangleStandsWhereTheReleaseEnded) {
    Recorder recorder(kEpoch, kEpoch + 1s);
    recorder.declare({1, 100ms, 1s, 0}, false);
    recorder.released(0, 1, kEpoch, kEpoch + 1s);
    recorder.does(0, 1, Doing::runs, kEpoch);
    recorder.does(0, 1, Doing::nothing, kEpoch + 250ms);
    recorder.ended(1, kEpoch + 250ms);
    const std::string page = svg_page(recorder.finish(kEpoch + 1s));
    // The axis lies from 176 to 1116: a quarter of it is at 411.
    EXPECT_THAT(page, HasSubstr("<path class=\"met\" d=\"M411.00 "));
}

TEST(Page, PinsAreDrawnAsALogicAnalyserDoes) {
    Schedule schedule = one_row(1);
    schedule.pins_until = schedule.until;
    schedule.pins = {{.name = "pin 4",
                      .remark = "what it <did>",
                      .stretches = {{kEpoch, kEpoch + 500ms, 0}, {kEpoch + 500ms, kEpoch + 1s, 1}}}};
    std::string page = svg_page(schedule);
    EXPECT_THAT(page,
                HasSubstr("<g class=\"pin\" data-pin=\"pin 4\">\n<title>pin 4: what it &lt;did&gt;</title>"));
    EXPECT_THAT(page, HasSubstr("H646.00V"));
    EXPECT_THAT(page, HasSubstr("@media (prefers-color-scheme:dark)"));
    for (int i = 0; i < 200'000; ++i) {
        const Instant at = kEpoch + i * 5us;
        schedule.pins[0].stretches.push_back({at, at + 2us, 1});
    }
    schedule.pins.resize(30, schedule.pins[0]);
    page = svg_page(schedule);
    EXPECT_THAT(page, HasSubstr("class=\"hatched\""));
    EXPECT_THAT(page, HasSubstr(">and 6 more</text>"));
    EXPECT_LT(page.size(), 2'000'000u);
}

TEST(Page, ABarSaysWhatItIs) {
    const std::string page = svg_page(one_row(1));
    EXPECT_THAT(page,
                HasSubstr("<title>loop 1 runs 500 ms: 0 ns to 500 ms; budget left: 1 ms, then 0 ns</title>"));
}

TEST(Page, ItsSizeIsBounded) {
    const std::string page = svg_page(one_row(200'000));
    EXPECT_LT(page.size(), 100'000u);
    EXPECT_THAT(page, HasSubstr("class=\"shares runs whole\""));
    // Half of the time, in each column.
    EXPECT_THAT(page, HasSubstr("v-9.00h1.00v9.00z"));
}

TEST(Page, RBeyondTIsMarkedAndNeverIsSaid) {
    Schedule schedule = one_row(1);
    schedule.responses = {
        {"loop 1", 1ms, 10ms, 12ms, {}}, {"loop 2", 1ms, 10ms, {}, 3ms}, {"loop 3", 1ms, 10ms, 4ms, 11ms}};
    const std::string page = svg_page(schedule);
    EXPECT_THAT(page, HasSubstr("class=\"part late\" x=\"892.00\" y="));
    EXPECT_THAT(page, HasSubstr(">R 12 ms &gt; T 10 ms</text>"));
    EXPECT_THAT(page, HasSubstr(">R: never ends, T 10 ms, longest here 3 ms</text>"));
    EXPECT_THAT(page, HasSubstr(">R 4 ms of T 10 ms, longest here 11 ms</text>"));
}

}  // namespace
}  // namespace qduino::apps::picture::page_test
