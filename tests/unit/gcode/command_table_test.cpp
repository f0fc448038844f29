#include "printer/gcode/command_table.h"

#include <gtest/gtest.h>

#include <string>

#include "printer/gcode/lexer.h"
#include "recorder.h"

namespace qduino::printer::gcode::command_table_test {
namespace {

const CodeInfo* find(std::string_view code) {
    Command command;
    return parse_words(code, command).ok() ? find_code(command) : nullptr;
}

/// `G92.1`, `EXCLUDE_OBJECT`; `M862` for all its subcodes.
std::string name_of(const Code& code) {
    if (code.letter == '\0') return std::string{code.word};
    std::string name = code.letter + std::to_string(code.number);
    if (code.subcode >= 0) name += "." + std::to_string(code.subcode);
    return name;
}

TEST(CommandTable, EveryRowHasANameAndLettersOnly) {
    for (const CodeInfo& info : known_codes()) {
        const std::string key = name_of(info.code);
        EXPECT_FALSE(info.name.empty()) << key;
        for (const char letter : info.parameters) EXPECT_TRUE(letter >= 'A' && letter <= 'Z') << key;
    }
}

TEST(CommandTable, EveryRowIsFoundByItsOwnCode) {
    for (const CodeInfo& info : known_codes()) {
        const bool any = info.code.subcode == Code::kAnySubcode;
        EXPECT_EQ(find(name_of(info.code) + (any ? ".7" : "")), &info) << name_of(info.code);
    }
}

/// Every code that slicers and hosts of the Marlin dialect are known to emit.
TEST(CommandTable, KnowsTheWholeDialect) {
    for (const char* code : {"G0",
                             "G1",
                             "G2",
                             "G3",
                             "G4",
                             "G10",
                             "G11",
                             "G20",
                             "G21",
                             "G28",
                             "G29",
                             "G80",
                             "G90",
                             "G91",
                             "G92",
                             "M82",
                             "M83",
                             "M104",
                             "M109",
                             "M140",
                             "M190",
                             "M141",
                             "M191",
                             "M106",
                             "M107",
                             "M201",
                             "M203",
                             "M204",
                             "M205",
                             "M73",
                             "M117",
                             "M300",
                             "M0",
                             "M1",
                             "M600",
                             "M601",
                             "M220",
                             "M221",
                             "M900",
                             "M572",
                             "M593",
                             "M486",
                             "M84",
                             "M18",
                             "M92",
                             "T0",
                             "T1",
                             "M862.1",
                             "M862.3",
                             "M862.6",
                             "M115",
                             "M105",
                             "M110",
                             "M112",
                             "M114",
                             "M155",
                             "M108",
                             "M410",
                             "G92.1",
                             "EXCLUDE_OBJECT_DEFINE",
                             "EXCLUDE_OBJECT_START",
                             "EXCLUDE_OBJECT_END"}) {
        EXPECT_NE(find(code), nullptr) << code;
    }
}

TEST(CommandTable, DoesNotKnowWhatIsNotThere) {
    for (const char* code :
         {"G999", "M99999", "G1.5", "G92.7", "X10", "FOO_BAR", "T100", "M104.1", "EXCLUDE_OBJECTS"}) {
        EXPECT_EQ(find(code), nullptr) << code;
    }
}

TEST(CommandTable, EveryCodeWithoutAHandlerIsAnsweredByNameAndDoesNothing) {
    for (const CodeInfo& code : known_codes()) {
        if (code.handler != nullptr) continue;
        const std::string text = name_of(code.code);
        Bench bench;
        const auto log = bench.run(text + "\n");
        ASSERT_EQ(log.size(), 1U) << text;
        EXPECT_EQ(log[0].rfind("not done line 1: " + text, 0), 0U) << log[0];
        EXPECT_NE(log[0].find(code.name), std::string::npos) << log[0];
        EXPECT_EQ(bench.interpreter.codes_not_done(), 1U);
        EXPECT_EQ(bench.interpreter.unknown_codes(), 0U);
    }
}

TEST(CommandTable, FreeText) {
    EXPECT_TRUE(takes_free_text('M', 117));
    EXPECT_FALSE(takes_free_text('G', 117));
    EXPECT_FALSE(takes_free_text('M', 104));
}

TEST(CommandTable, TheTailOfACodeThatIsCarriedOutMustBeWords) {
    EXPECT_TRUE(must_be_words('G', 1));
    EXPECT_TRUE(must_be_words('G', 92));
    EXPECT_TRUE(must_be_words('T', 7));
    EXPECT_FALSE(must_be_words('M', 117)) << "a text";
    EXPECT_FALSE(must_be_words('M', 486)) << "words, or a name";
    EXPECT_FALSE(must_be_words('M', 32)) << "refused, whatever follows";
    EXPECT_FALSE(must_be_words('M', 300)) << "skipped";
    EXPECT_FALSE(must_be_words('M', 1002)) << "unknown";
}

/// The whole list: a code that may be typed over a print has been thought about.
TEST(CommandTable, WhatMayBeTypedBesidesAJobIsThis) {
    const auto typed = [](Typed when) {
        std::string codes;
        for (const CodeInfo& info : known_codes()) {
            if (info.typed == when) codes += name_of(info.code) + " ";
        }
        return codes;
    };
    EXPECT_EQ(typed(Typed::parked), "F0 G0 G1 G90 G91 M82 M83 ");
    EXPECT_EQ(typed(Typed::printing),
              "EXCLUDE_OBJECT M104 M106 M107 M140 M220 M221 M301 M304 M486 M500 M568 ");
    EXPECT_EQ(typed(Typed::always), "GET_POSITION M73 M105 M108 M112 M114 M115 M117 M302 M410 M503 ");
    Command unknown;
    ASSERT_TRUE(parse_words("M9999", unknown).ok());
    EXPECT_EQ(may_be_typed(unknown), Typed::at_rest);
}

}  // namespace
}  // namespace qduino::printer::gcode::command_table_test
