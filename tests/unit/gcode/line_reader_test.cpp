#include "printer/gcode/line_reader.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace qduino::printer::gcode::line_reader_test {
namespace {

struct Read {
    std::string code, comment, error;
    bool comment_cut = false;
    HostFrame frame{};
    Source source;
};

std::vector<Read> read_all(std::string_view bytes, std::size_t chunk = 1 << 20) {
    LineReader reader;
    RawLine line;
    std::vector<Read> out;
    const auto keep = [&] {
        out.push_back({std::string(line.code), std::string(line.comment),
                       line.error ? std::string(line.error->message.view()) : "", line.comment_cut,
                       line.frame, line.source});
    };
    for (std::size_t at = 0; at < bytes.size(); at += chunk) {
        const std::string_view piece = bytes.substr(at, chunk);
        std::span<const char> input{piece.data(), piece.size()};
        while (reader.next(input, line)) keep();
    }
    if (reader.finish(line)) keep();
    return out;
}

TEST(LineReader, EveryLineEndIsOneLineEnd) {
    for (const std::size_t chunk : {1U, 2U, 3U, 100U}) {
        const auto lines = read_all("G1\nG2\r\nG3\rG4\n\r\nG5", chunk);
        ASSERT_EQ(lines.size(), 6U) << chunk;
        const char* const expected[] = {"G1", "G2", "G3", "G4", "", "G5"};
        for (std::size_t i = 0; i < lines.size(); ++i) {
            EXPECT_EQ(lines[i].code, expected[i]);
            EXPECT_EQ(lines[i].source.line, i + 1);
        }
    }
}

TEST(LineReader, ASourceSaysWhereALineStands) {
    const auto lines = read_all("G1 X1\r\n  G28\nM84");
    ASSERT_EQ(lines.size(), 3U);
    // The LF of CR LF is swallowed with the next line's first byte.
    EXPECT_EQ(lines[0].source, (Source{0, 6, 1, 5}));
    EXPECT_EQ(lines[1].source, (Source{7, 13, 2, 5}));
    EXPECT_EQ(lines[2].source, (Source{13, 16, 3, 3}));
}

TEST(LineReader, CodeAndCommentArePartedAtTheSemicolon) {
    struct Case {
        const char *line, *code, *comment;
    };
    const Case cases[] = {
        {"G1 X10 ; go", "G1 X10", " go"},
        {";TYPE:FILL", "", "TYPE:FILL"},
        {"G1;a;b", "G1", "a;b"},
        {"  G1 X1\t ", "G1 X1", ""},
        {"G1 (why; because) X1 ; x", "G1   X1", " x"},
        {"(all of it)", "", ""},
        {"G1 ; (open", "G1", " (open"},
        {"M117 50% (done) \"ok", "M117 50% (done) \"ok", ""},
        {"M117 a;b", "M117 a", "b"},
        {"m117 (", "m117 (", ""},
        {"M106 S\"a;b\" ; check", "M106 S\"a;b\"", " check"},
        {"M106 S\"(1)\"", "M106 S\"(1)\"", ""},
        {"M486 Apart (1", "M486 Apart (1", ""},
        {"M862.3 P \"MK3\" ; check", "M862.3 P \"MK3\"", " check"},
        {"EXCLUDE_OBJECT NAME=\"a;b\" ;c", "EXCLUDE_OBJECT NAME=\"a;b\"", "c"},
        {"EXCLUDE_OBJECT NAME=12\";c\"", "EXCLUDE_OBJECT NAME=12\"", "c\""},
        {"EXCLUDE_OBJECT NAME=\"a;b", "EXCLUDE_OBJECT NAME=\"a", "b"},
        {"EXCLUDE_OBJECT NAME=a(", "EXCLUDE_OBJECT NAME=a(", ""},
        {"", "", ""},
        {"   ", "", ""},
        {";", "", ""},
    };
    for (const Case& c : cases) {
        const auto lines = read_all(std::string(c.line) + "\n");
        ASSERT_EQ(lines.size(), 1U) << c.line;
        EXPECT_EQ(lines[0].error, "") << c.line;
        EXPECT_EQ(lines[0].code, c.code) << c.line;
        EXPECT_EQ(lines[0].comment, c.comment) << c.line;
    }
}

TEST(LineReader, ParenthesesMustPair) {
    EXPECT_NE(read_all("G1 (open\n")[0].error.find("line 1, byte 0: a ( without"), std::string::npos);
    EXPECT_NE(read_all("G1 close)\n")[0].error.find("a ) without"), std::string::npos);
}

TEST(LineReader, AByteOrderMarkIsSkippedAtTheBeginningOnly) {
    const auto lines = read_all("\xEF\xBB\xBFG28\nG1\n");
    EXPECT_EQ(lines[0].code, "G28");
    EXPECT_EQ(read_all("G28\n\xEF\xBB\xBFG1\n")[1].code, "\xEF\xBB\xBFG1");
}

TEST(LineReader, HostFramesAreTakenOff) {
    struct Case {
        std::string line;
        std::optional<std::int64_t> number;
        Checksum checksum;
        std::string code;
    };
    const auto summed = [](const std::string& line) {
        unsigned sum = 0;
        for (const char c : line) sum ^= static_cast<unsigned char>(c);
        return line + "*" + std::to_string(sum);
    };
    const Case cases[] = {
        {"N3 T0*57", 3, Checksum::right, "T0"},  // the example of the RepRap wiki
        {summed("N7 G1 X10 Y-5"), 7, Checksum::right, "G1 X10 Y-5"},
        {summed("N0 M110 N0 "), 0, Checksum::right, "M110 N0"},
        {summed("N5 M117 a*b"), 5, Checksum::right, "M117 a*b"},
        {summed("n 9 g28") + " ", 9, Checksum::right, "g28"},
        {summed("N12G1X1") + " ; comment", 12, Checksum::right, "G1X1"},
        {"N8 G28", 8, Checksum::absent, "G28"},
        {summed("N-1 M110"), -1, Checksum::right, "M110"},
        {"M117 5*5", std::nullopt, Checksum::absent, "M117 5*5"},
    };
    for (const Case& c : cases) {
        const auto lines = read_all(c.line + "\n");
        EXPECT_EQ(lines[0].error, "") << c.line;
        EXPECT_EQ(lines[0].frame.number, c.number) << c.line;
        EXPECT_EQ(lines[0].frame.checksum, c.checksum) << c.line;
        EXPECT_EQ(lines[0].code, c.code) << c.line;
    }
}

TEST(LineReader, AWrongCheckSumIsAnErrorAndHasNoCode) {
    for (const char* line : {"N3 T0*56", "N3 T0*", "N3 T0*5x", "N3 T0*-57", "N3 T0*313"}) {
        const auto lines = read_all(std::string(line) + "\n");
        EXPECT_NE(lines[0].error.find("check sum"), std::string::npos) << line;
        EXPECT_EQ(lines[0].code, "") << line;
        EXPECT_EQ(lines[0].frame.checksum, Checksum::wrong) << line;
    }
}

TEST(LineReader, ACommandOf256BytesIsTheLongest) {
    const std::string longest = "G1 X" + std::string(kCommandBytesMax - 4, '1');
    EXPECT_EQ(read_all(longest + "\n")[0].code, longest);
    const auto lines = read_all("G28\n" + longest + "1 ; c\nG29\n");
    EXPECT_NE(lines[1].error.find("line 2, byte 4: the command is 257 bytes long"), std::string::npos)
        << lines[1].error;
    EXPECT_EQ(lines[1].code, "");
    EXPECT_EQ(lines[2].code, "G29");
}

TEST(LineReader, AWordCommandMayBeLonger) {
    const std::string polygon = "EXCLUDE_OBJECT_DEFINE NAME=a POLYGON=[" + std::string(600, '1') + "]";
    EXPECT_EQ(read_all(polygon + "\n")[0].code, polygon);
}

TEST(LineReader, ALongCommentIsCutAndTheCommandStands) {
    const std::string line = "G1 X1 ;" + std::string(100'000, 'c');
    const auto lines = read_all(line + "\nG28\n", 4096);
    ASSERT_EQ(lines.size(), 2U);
    EXPECT_EQ(lines[0].code, "G1 X1");
    EXPECT_TRUE(lines[0].comment_cut);
    EXPECT_EQ(lines[0].comment.size(), kLineBytesMax - 7);
    EXPECT_EQ(lines[0].source.length, line.size());
    EXPECT_EQ(lines[1].code, "G28");
    EXPECT_EQ(lines[1].source.offset, line.size() + 1);
}

TEST(LineReader, ALineOfTenMegabytesIsOneErrorInConstantMemory) {
    LineReader reader;
    RawLine line;
    const std::string chunk(1 << 16, 'X');
    const std::uint64_t chunks = 160;
    for (std::uint64_t i = 0; i < chunks; ++i) {
        std::span<const char> input{chunk.data(), chunk.size()};
        ASSERT_FALSE(reader.next(input, line));
        ASSERT_TRUE(input.empty());
    }
    const std::string end = "\nG28\n";
    std::span<const char> input{end.data(), end.size()};
    ASSERT_TRUE(reader.next(input, line));
    ASSERT_TRUE(line.error);
    EXPECT_NE(std::string(line.error->message.view()).find("the command is 10485760 bytes long"),
              std::string::npos);
    EXPECT_EQ(line.source.length, chunks * chunk.size());
    ASSERT_TRUE(reader.next(input, line));
    EXPECT_FALSE(line.error);
    EXPECT_EQ(line.code, "G28");
}

TEST(LineReader, ANulByteIsFoundWhereverItStands) {
    std::string bytes = "G28\nG1 X1 ; " + std::string(2000, 'c');
    const std::size_t at = bytes.size();
    bytes += std::string("\0\0rest\nG1\n", 10);
    for (const std::size_t chunk : {1U, 7U, 4096U}) {
        const auto lines = read_all(bytes, chunk);
        ASSERT_EQ(lines.size(), 3U);
        EXPECT_NE(lines[1].error.find("a NUL byte at " + std::to_string(at)), std::string::npos)
            << lines[1].error;
        EXPECT_NE(lines[1].error.find("a text holds none"), std::string::npos);
        EXPECT_EQ(lines[2].error, "");
    }
}

TEST(LineReader, ResetGoesOnWhereAJobIsResumed) {
    LineReader reader;
    reader.reset(1000, 41);
    const std::string text = "G1\n";
    std::span<const char> input{text.data(), text.size()};
    RawLine line;
    ASSERT_TRUE(reader.next(input, line));
    EXPECT_EQ(line.source, (Source{1000, 1003, 42, 2}));
    EXPECT_EQ(reader.offset(), 1003U);
}

}  // namespace
}  // namespace qduino::printer::gcode::line_reader_test
