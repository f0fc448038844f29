#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <regex>
#include <string>

#include "printer/gcode/command_table.h"
#include "printer/gcode/emergency_scanner.h"
#include "printer/gcode/lexer.h"
#include "printer/gcode/parser.h"
#include "random_gcode.h"

namespace qduino::printer::gcode::reading_property_test {
namespace {

/// Everything that a line says, as text.
class Transcript {
  public:
    void operator()(const Line& line) {
        const Source& s = line.source;
        text += std::to_string(s.line) + "@" + std::to_string(s.offset) + "+" + std::to_string(s.length);
        if (line.error) text += " error " + std::string(line.error->message.view());
        if (line.command != nullptr) text += " " + describe(*line.command);
        text += " ;" + std::string(line.comment) + (line.comment_cut ? "…\n" : "\n");
        end = s.end_offset;
    }
    static std::string describe(const Command& command) {
        std::string out{command.name().view()};
        for (char letter = 'A'; letter <= 'Z'; ++letter) {
            if (!command.parameters.has(letter)) continue;
            const auto value = command.parameters.value(letter);
            out += std::string(" ") + letter + (value ? std::to_string(*value) : "");
        }
        return out + " [" + std::string(command.text.view()) + "]";
    }
    std::string text;
    std::uint64_t end = 0;
};

std::string transcript(const std::vector<std::string>& pieces) {
    Parser parser;
    Transcript sink;
    for (const std::string& piece : pieces) parser.feed({piece.data(), piece.size()}, sink);
    parser.finish(sink);
    return sink.text;
}

TEST(ReadingProperty, HoweverTheBytesAreCutTheLinesAreTheSame) {
    for (std::uint64_t seed = 0; seed < 400; ++seed) {
        RandomGcode random{seed};
        std::string bytes = random.noise(3000);
        if (random.chance(0.2)) bytes += ";" + std::string(random.below(3000), 'c') + "\nG1 X1";
        if (random.chance(0.2)) bytes += "G1 X" + std::string(random.below(3000), '1') + "\nG1 X1";
        const std::string whole = transcript({bytes});
        ASSERT_EQ(transcript(random.cut(bytes)), whole) << "seed " << seed;
    }
}

TEST(ReadingProperty, EveryByteBelongsToExactlyOneLine) {
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        RandomGcode random{seed};
        const std::string bytes = random.noise(2000);
        Parser parser;
        std::uint64_t expected = 0;
        std::uint64_t number = 0;
        std::span<const char> input{bytes.data(), bytes.size()};
        const Line* line = nullptr;
        while ((line = parser.next(input)) != nullptr || (line = parser.finish()) != nullptr) {
            const Source& s = line->source;
            // A LF that belongs to the CR before it stands between two lines.
            const bool swallowed =
                s.offset == expected + 1 && bytes[expected] == '\n' && bytes[expected - 1] == '\r';
            ASSERT_TRUE(s.offset == expected || swallowed) << "seed " << seed << " line " << s.line;
            ASSERT_EQ(s.line, ++number);
            ASSERT_GE(s.end_offset, s.offset + s.length);
            ASSERT_LE(s.end_offset, s.offset + s.length + 1);
            ASSERT_EQ(bytes.substr(s.offset, s.length).find_first_of("\r\n"), std::string::npos);
            expected = s.end_offset;
        }
        ASSERT_GE(expected + 1, bytes.size()) << "seed " << seed;
    }
}

/// The naive oracle: a regular expression a word, and the C library's numbers.
struct Oracle {
    std::string code;
    std::array<bool, 26> has{};
    std::array<std::optional<double>, 26> value{};

    explicit Oracle(const std::string& line) {
        static const std::regex kCode{"^ *([A-Za-z]) *([0-9]+)(\\.([0-9]+))?"};
        static const std::regex kWord{"([A-Za-z]) *([-+]?([0-9]+\\.?[0-9]*|\\.[0-9]+))?"};
        std::smatch match;
        if (!std::regex_search(line, match, kCode)) return;
        code = static_cast<char>(std::toupper(match[1].str()[0])) + std::to_string(std::stoul(match[2]));
        if (match[4].matched) code += "." + std::to_string(std::stoul(match[4]));
        const std::string rest = match.suffix();
        for (std::sregex_iterator word{rest.begin(), rest.end(), kWord}, end; word != end; ++word) {
            const auto index = static_cast<std::size_t>(std::toupper((*word)[1].str()[0]) - 'A');
            has[index] = true;
            if ((*word)[2].matched) value[index] = std::strtod((*word)[2].str().c_str(), nullptr);
        }
    }
};

TEST(ReadingProperty, AWellFormedCommandReadsAsTheNaiveOracleReadsIt) {
    for (std::uint64_t seed = 0; seed < 20'000; ++seed) {
        RandomGcode random{seed};
        const std::string line = random.command();
        Command command;
        const auto words = parse_words(line, command);
        ASSERT_TRUE(words.ok() && *words)
            << "seed " << seed << ": " << line << ": " << words.error().message.view();
        if (takes_free_text(command.letter, command.number)) continue;
        const Oracle oracle{line};
        if (oracle.code == "M486" && oracle.has[0]) continue;  // what stands behind A is a name
        ASSERT_EQ(std::string(command.name().view()), oracle.code) << "seed " << seed << ": " << line;
        for (char letter = 'A'; letter <= 'Z'; ++letter) {
            const auto index = static_cast<std::size_t>(letter - 'A');
            ASSERT_EQ(command.parameters.has(letter), oracle.has[index]) << "seed " << seed << ": " << line;
            ASSERT_EQ(command.parameters.value(letter), oracle.value[index])
                << "seed " << seed << ": " << line;
        }
    }
}

TEST(ReadingProperty, AFrameWithItsOwnCheckSumIsRightAndWithAnyOtherWrong) {
    for (std::uint64_t seed = 0; seed < 2000; ++seed) {
        RandomGcode random{seed};
        const std::string body = "N" + std::to_string(random.below(100'000)) + " " + random.command();
        unsigned sum = 0;
        for (const char c : body) sum ^= static_cast<unsigned char>(c);
        const unsigned other = (sum + 1 + static_cast<unsigned>(random.below(255))) % 256;
        for (const unsigned given : {sum, other}) {
            const std::string line = body + "*" + std::to_string(given) + "\n";
            Parser parser;
            std::span<const char> input{line.data(), line.size()};
            const Line* parsed = parser.next(input);
            ASSERT_EQ(parsed->frame.checksum, given == sum ? Checksum::right : Checksum::wrong) << line;
            ASSERT_EQ(parsed->command != nullptr, given == sum) << line;
        }
    }
}

TEST(ReadingProperty, TheEmergencyScannerSeesWhatTheParserSees) {
    for (std::uint64_t seed = 0; seed < 500; ++seed) {
        RandomGcode random{seed};
        std::string text;
        for (int i = 0; i < 50; ++i) {
            const char* const kLines[] = {"M112",    "M1120",   "; M112", "M117 M112",
                                          "N7 M112", "G1 X112", "m 112 ", "M0112"};
            text += std::string(random.chance(0.02) ? random.pick(kLines) : "G1 X1") + "\n";
        }
        bool parsed = false;
        Parser parser;
        std::span<const char> input{text.data(), text.size()};
        while (const Line* line = parser.next(input)) {
            const Command* command = line->command;
            parsed |= command != nullptr && command->letter == 'M' && command->number == 112;
        }
        EmergencyScanner scanner;
        bool found = false;
        for (const std::string& piece : random.cut(text))
            found |= scanner.feed({piece.data(), piece.size()}).stop;
        ASSERT_EQ(found, parsed) << "seed " << seed;
    }
}

}  // namespace
}  // namespace qduino::printer::gcode::reading_property_test
