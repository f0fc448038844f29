// The Arduino IDE 2's commands, as bytes: how they are split, what comes in which state, and that
// no bytes lead astray.
#include "qduino/ide/ide_tool.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "qduino/common/child_process.h"
#include "qduino/ide/ide_discovery.h"
#include "qduino/ide/ide_monitor.h"

namespace qduino::apps::ide_tool_test {
namespace {

using nlohmann::json;

TEST(IdeTool, ACommandIsSplitAtBlanksAndAQuotedNameIsOneWord) {
    EXPECT_EQ(words_of_command(R"(HELLO 1 "Arduino IDE 2.3")"), (Words{"HELLO", "1", "Arduino IDE 2.3"}));
    EXPECT_EQ(words_of_command("  OPEN\t127.0.0.1:4711  pi@there\r"),
              (Words{"OPEN", "127.0.0.1:4711", "pi@there"}));
    EXPECT_EQ(words_of_command(R"(A "")"), (Words{"A", ""}));
    EXPECT_EQ(words_of_command(R"(A "b c)"), (Words{"A", "b c"}));
    EXPECT_EQ(words_of_command(" \t\r"), Words{});
}

/// A line of no quotes is split as a stream is.
TEST(IdeTool, WithoutQuotesItSplitsAsAStreamDoes) {
    const auto seed = std::random_device{}();
    std::mt19937 random{seed};
    for (int round = 0; round < 2000; ++round) {
        std::string line;
        for (unsigned left = random() % 12; left > 0; --left) line += "aZ1 \t\r:"[random() % 7];
        Words words;
        std::istringstream stream{line};
        for (std::string word; stream >> word;) words.push_back(word);
        EXPECT_EQ(words_of_command(line), words) << "seed " << seed << ": '" << line << "'";
    }
}

/// All messages that an answer is made of; each must be whole.
std::vector<json> messages_in(const std::string& answer) {
    std::vector<json> messages;
    for (std::size_t begin = 0; begin < answer.size();) {
        const std::size_t end = answer.find("\n}\n", begin);
        messages.push_back(json::parse(answer.substr(begin, end + 3 - begin)));
        begin = end + 3;
    }
    return messages;
}

/// "start", or "-list" for an error.
std::string kinds_in(const std::string& answer) {
    std::string kinds;
    for (const json& message : messages_in(answer)) {
        kinds += kinds.empty() ? "" : " ";
        kinds += message.value("error", false) ? "-" : "";
        kinds += message["eventType"].get<std::string>();
    }
    return kinds;
}

TEST(IdeTool, EachStateOfADiscoveryHasItsCommands) {
    const std::string hello = R"(HELLO 1 "test")";
    const std::vector<std::pair<Words, std::string>> cases{
        {{"START"}, "-command_error"},
        {{"HELLO 0 \"test\""}, "-command_error"},
        {{"HELLO 1"}, "-command_error"},
        {{hello, hello}, "-command_error"},
        {{hello, "LIST"}, "-list"},
        {{hello, "STOP"}, "-stop"},
        {{hello, "START", "LIST"}, "list"},
        {{hello, "START", "START"}, "-start"},
        {{hello, "START", "STOP", "LIST"}, "-list"},
        {{hello, "START", "STOP", "STOP"}, "-stop"},
        {{hello, "START_SYNC"}, "start_sync add add"},
        {{hello, "START", "START_SYNC"}, "start_sync add add"},
        {{hello, "START_SYNC", "START_SYNC"}, "-start_sync"},
        {{hello, "START_SYNC", "LIST"}, "-list"},
        {{hello, "START_SYNC", "STOP", "START_SYNC"}, "start_sync add add"},
        {{hello, "LIST all"}, "-command_error"},
        {{hello, "DESCRIBE"}, "-command_error"},
        {{""}, "-command_error"},
        {{"QUIT"}, "quit"},
    };
    for (const auto& [lines, expected] : cases) {
        IdeDiscovery discovery(ports_of({"pi@there"}));
        std::string last;
        for (const std::string& line : lines) last = discovery.answer_to(line);
        EXPECT_EQ(kinds_in(last), expected) << shell_words(lines);
        EXPECT_EQ(discovery.quits(), lines.back() == "QUIT");
    }
}

TEST(IdeTool, ADiscoveryOfTheOldIdeBeginsWithoutAGreeting) {
    IdeDiscovery discovery(ports_of({}), IdeTool::Greeting::none);
    EXPECT_EQ(kinds_in(discovery.answer_to("START_SYNC")), "start_sync add");
}

TEST(IdeTool, AMonitorThatIsNotOpenSaysSo) {
    IdeMonitor monitor;
    EXPECT_EQ(kinds_in(monitor.answer_to(R"(HELLO 2 "test")")), "hello");
    EXPECT_EQ(kinds_in(monitor.answer_to("CLOSE")), "-close");
    EXPECT_EQ(kinds_in(monitor.answer_to("CONFIGURE baudrate 9600")), "-configure");
    EXPECT_EQ(kinds_in(monitor.answer_to("CONFIGURE baudrate")), "-command_error");
    // A name that ssh would take for an option.
    EXPECT_EQ(kinds_in(monitor.answer_to("OPEN 127.0.0.1:9 -oProxyCommand=x")), "-open");
    EXPECT_TRUE(monitor.waits().empty());
}

TEST(IdeTool, AnyBytesAreAnsweredByWholeMessages) {
    const auto seed = std::random_device{}();
    std::mt19937 random{seed};
    IdeDiscovery discovery(ports_of({}));
    static_cast<void>(discovery.answer_to(R"(HELLO 1 "test")"));
    for (int round = 0; round < 2000; ++round) {
        std::string line;
        for (unsigned left = random() % 20; left > 0; --left) line += static_cast<char>(random() % 256);
        const std::string answer = discovery.answer_to(line);
        ASSERT_EQ(messages_in(answer).size(), 1u) << "seed " << seed;
    }
}

}  // namespace
}  // namespace qduino::apps::ide_tool_test
