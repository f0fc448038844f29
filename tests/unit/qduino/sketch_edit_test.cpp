// A profile's numbers in the text of a sketch: in its own units, every other byte as it was, and
// what is no number refused.
#include "qduino/build/sketch_edit.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <random>

#include "qduino/trace/profile_result.h"
#include "tests/unit/qduino/temporary_folder.h"

namespace qduino::apps::sketch_edit_test {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr Nanoseconds kMs = 1ms;

class SketchEditTest : public TemporaryFolder {
  protected:
    /// One tab with `text`, and one edit of its loop 1, declared in line `line`.
    EditedSketch edit(const std::string& text, BudgetEdit edit, int line = 1) {
        edit.id = 1;
        edit.file = "/a/a.ino";
        edit.line = line;
        return edit_budgets({{"/a/a.ino", text}}, {edit});
    }
    static BudgetEdit change(Nanoseconds from, Nanoseconds to) {
        return {.id = 1,
                .file = "",
                .line = 0,
                .budget_was = from,
                .period_was = 10ms,
                .budget = to,
                .period = 10ms};
    }
};

TEST_F(SketchEditTest, ALiteralKeepsItsUnitWhereItCan) {
    EXPECT_EQ(literal_for(170us, "2", kMs), "0.17");
    EXPECT_EQ(literal_for(3ms, "2", kMs), "3");
    EXPECT_EQ(literal_for(170us, "2000", 1us), "170");
    EXPECT_EQ(literal_for(4400ns, "2000", 1us), "4.4");
    EXPECT_EQ(literal_for(4400ns, "9", 1ns), "4400");
    EXPECT_EQ(literal_for(1200ms, "1", 1s), "1.2");
    EXPECT_EQ(literal_for(3ms, "2ms", kMs), "3ms");
    EXPECT_EQ(literal_for(170us, "2ms", kMs), "170us");
    EXPECT_EQ(literal_for(4400ns, "2ms", kMs), "4400ns");
    EXPECT_EQ(literal_for(170us, "0.5ms", kMs), "170us") << "a fraction would be rounded by the compiler";
    EXPECT_EQ(literal_for(2s, "90000us", 1us), "2000000us");
}

TEST_F(SketchEditTest, OnlyTheNumberChangesAndEveryOtherByteStays) {
    const std::string text =
        "// loop(1, 2, 10)\r\nconst char* s = \"loop(1, 2, 10) \\\" {\"; /* loop(1, 2, 10) */\r\n"
        "#define X loop(1, 2, 10) \\\r\n  loop(1, 2, 10)\r\n"
        "char q = '\\''; auto r = R\"x(loop(1, 2, 10) \")x\"; long n = 1'000;\r\n"
        "\tvoid loop( 1 ,\t2 ,10, /* core */ 0) { /* body */ }\r\nvoid loop(2, 2, 10) {}";
    const EditedSketch edited = edit(text, change(2ms, 170us), 6);
    EXPECT_THAT(edited.refusals, IsEmpty());
    std::string expected = text;
    expected.replace(expected.find("\t2 ,10") + 1, 1, "0.17");
    EXPECT_EQ(edited.tabs[0].text, expected);
    EXPECT_EQ(edited.diff,
              "--- a.ino\n+++ a.ino\n@@ -6 +6 @@\n-\tvoid loop( 1 ,\t2 ,10, /* core */ 0) { /* body */ }\n"
              "+\tvoid loop( 1 ,\t0.17 ,10, /* core */ 0) { /* body */ }\n");
}

TEST_F(SketchEditTest, TheUnitOfTheSketchHoldsBelowItAndInTheTabsBehind) {
    const std::vector<TabText> tabs{{"/a/a.ino", "TIME_UNIT(us);\nvoid loop(1, 2000, 10000) {}\n"},
                                    {"/a/b.ino", "void loop(2, 2'000, 20ms) {}\n"}};
    const EditedSketch edited = edit_budgets(
        tabs, {{1, "/a/a.ino", 2, 2ms, 10ms, 170us, 10ms}, {2, "/a/b.ino", 1, 2ms, 20ms, 5ms, 40ms}});
    EXPECT_THAT(edited.refusals, IsEmpty());
    EXPECT_EQ(edited.tabs[0].text, "TIME_UNIT(us);\nvoid loop(1, 170, 10000) {}\n");
    EXPECT_EQ(edited.tabs[1].text, "void loop(2, 5000, 40ms) {}\n");
}

TEST_F(SketchEditTest, ADeclarationOverSeveralLinesIsFoundByAnyOfThem) {
    const std::string text = "void loop(1,\n  2ms,  // budget\n  10) {\n}\n";
    for (const int line : {1, 2, 3}) {
        const EditedSketch edited = edit(text, change(2ms, 3ms), line);
        EXPECT_THAT(edited.refusals, IsEmpty());
        EXPECT_EQ(edited.tabs[0].text, "void loop(1,\n  3ms,  // budget\n  10) {\n}\n");
    }
    EXPECT_EQ(edit(text, change(2ms, 3ms), 4).refusals.size(), 1u);
}

TEST_F(SketchEditTest, WhatIsNoNumberIsRefusedAndThenNothingChanges) {
    for (const char* budget :
         {"kBudget", "1 + 1", "BUDGET(2)", "2.0f", "0x2", "02", "2u", "(2)", "2min2", "2 /* ms */"}) {
        const auto text = std::string{"void loop(1, "} + budget + ", 10) {}\n";
        const EditedSketch edited = edit(text, change(2ms, 170us));
        ASSERT_EQ(edited.refusals.size(), 1u) << budget;
        EXPECT_THAT(edited.refusals[0], HasSubstr("loop 1 (a.ino:1): its budget is `"));
        EXPECT_THAT(edited.refusals[0], HasSubstr("make it 170 us by hand"));
        EXPECT_EQ(edited.tabs[0].text, text);
    }
    const EditedSketch half =
        edit_budgets({{"/a/a.ino", "void loop(1, 2, 10) {}\nvoid loop(2, k, 10) {}\n"}},
                     {{1, "/a/a.ino", 1, 2ms, 10ms, 3ms, 10ms}, {2, "/a/a.ino", 2, 2ms, 10ms, 3ms, 10ms}});
    EXPECT_EQ(half.refusals.size(), 1u);
    EXPECT_EQ(half.tabs[0].text, "void loop(1, 2, 10) {}\nvoid loop(2, k, 10) {}\n");
    EXPECT_THAT(half.diff, HasSubstr("+void loop(1, 3, 10)")) << "it shows what would change";
}

TEST_F(SketchEditTest, AHandlerIsFoundByItsPinWhichStandsInOneCallAlone) {
    const BudgetEdit edit{.id = 7,
                          .file = "",
                          .line = 0,
                          .budget_was = 1ms,
                          .period_was = 10ms,
                          .budget = 240us,
                          .period = 10ms,
                          .handler = true};
    const auto changed = [&](const std::string& text) { return edit_budgets({{"/a/a.ino", text}}, {edit}); };
    const std::string call = "void setup() { attachInterruptVcpu(7, on_edge, RISING, 1, 10, 0); }\n";
    EXPECT_EQ(changed(call).tabs[0].text,
              "void setup() { attachInterruptVcpu(7, on_edge, RISING, 0.24, 10, 0); }\n");
    EXPECT_EQ(changed("void loop(7, 1, 10) {}\n" + call).refusals.size(), 0u) << "a loop is no pin";
    EXPECT_THAT(changed(call + call).refusals,
                ElementsAre(HasSubstr("the handler of pin 7: no tab has one")));
    EXPECT_THAT(changed("void setup() { attachInterruptVcpu(kPin, on_edge, RISING, 1, 10); }\n").refusals,
                ElementsAre(HasSubstr("change it by hand")));
}

TEST_F(SketchEditTest, ALoopThatStatesItsSleepIsFoundToo) {
    EXPECT_EQ(edit("void loop(1, 2, 10, 0, 3) {}\n", change(2ms, 4ms)).tabs[0].text,
              "void loop(1, 4, 10, 0, 3) {}\n");
}

TEST_F(SketchEditTest, ATextThatIsNotWhatTheProgramHadIsRefused) {
    EXPECT_THAT(edit("void loop(1, 2, 10) {}", change(3ms, 170us)).refusals,
                ElementsAre(HasSubstr("reads as 2 ms, and the program had 3 ms")));
    EXPECT_THAT(edit("void loop(3, 2, 10) {}", change(2ms, 170us)).refusals,
                ElementsAre(HasSubstr("is in no tab")));
    EXPECT_THAT(edit("\n\nvoid loop(1, 2, 10) {}", change(2ms, 170us)).refusals,
                ElementsAre(HasSubstr("is in no tab")));
}

TEST_F(SketchEditTest, ANumberThatStaysMayBeAnything) {
    const EditedSketch edited = edit("void loop(1, 2, kPeriod) {}", change(2ms, 170us));
    EXPECT_THAT(edited.refusals, IsEmpty());
    EXPECT_EQ(edited.tabs[0].text, "void loop(1, 0.17, kPeriod) {}");
    EXPECT_EQ(edit("void loop(1, k, k) {}", change(2ms, 2ms)).diff, "");
}

TEST_F(SketchEditTest, NoTextMakesItStumble) {
    const auto seed = static_cast<std::uint64_t>(std::random_device{}());
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random{seed};
    const std::array<const char*, 16> pieces{"loop", "(",  ")",  ",",  "1",  "2",    "10", "\"",
                                             "'",    "/*", "*/", "//", "\n", "R\"(", "\\", "TIME_UNIT(us)"};
    for (int round = 0; round < 3000; ++round) {
        std::string text;
        for (std::size_t i = random() % 40; i > 0; --i) text += pieces[random() % pieces.size()];
        const EditedSketch edited = edit(text, change(2ms, 170us), 1 + static_cast<int>(random() % 3));
        if (edited.refusals.empty()) continue;
        EXPECT_EQ(edited.tabs[0].text, text);
    }
}

TEST_F(SketchEditTest, TabsAreWrittenWithTheirPermissionsAndThroughLinks) {
    write("real.ino", "void loop(1, 2, 10) {}\n");
    write("same.ino", "// nothing\n");
    fs::permissions(folder_ / "real.ino", fs::perms{0640});
    fs::create_symlink(folder_ / "real.ino", folder_ / "link.ino");
    const auto before = read_tabs({folder_ / "link.ino", folder_ / "same.ino"});
    ASSERT_TRUE(before);
    std::vector<TabText> after = *before;
    after[0].text = "void loop(1, 0.17, 10) {}\n";
    ASSERT_TRUE(write_tabs(*before, after));
    EXPECT_EQ(read(folder_ / "real.ino"), after[0].text);
    EXPECT_TRUE(fs::is_symlink(folder_ / "link.ino"));
    EXPECT_EQ(fs::status(folder_ / "real.ino").permissions(), fs::perms{0640});

    // It has changed since it was read: whoever changed it keeps the change.
    const Result<void> stale = write_tabs(*before, after);
    ASSERT_FALSE(stale);
    EXPECT_THAT(std::string{stale.error().message.view()}, HasSubstr("was changed while"));
}

TEST_F(SketchEditTest, AProfileOfAnotherShapeIsAnErrorAndNoCrash) {
    for (const char* text : {"", "{}", "[]", R"({"loops":[{}],"handlers":[]})", R"({"loops":[]})",
                             R"({"loops":[{"declared":1,"suggested":{}}],"handlers":[]})"})
        EXPECT_FALSE(suggested_edits(text)) << text;
    const auto none = suggested_edits(
        R"({"loops":[{"id":1,"file":"","line":1,"declared":{},"suggested":null}],"handlers":[]})");
    ASSERT_TRUE(none) << none.error().message.view();
    EXPECT_TRUE(none->empty());
    const auto handler = suggested_edits(
        R"({"loops":[],"handlers":[{"pin":7,"declared":{"budget_ns":9,"period_ns":20},
            "suggested":{"budget_ns":5,"period_ns":20}}]})");
    ASSERT_TRUE(handler);
    ASSERT_EQ(handler->size(), 1u);
    EXPECT_TRUE(handler->at(0).handler);
    EXPECT_EQ(handler->at(0).id, 7);
    EXPECT_EQ(handler->at(0).budget, Nanoseconds{5});
}

}  // namespace
}  // namespace qduino::apps::sketch_edit_test
