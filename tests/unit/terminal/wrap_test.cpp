// Commands stay commands when they are broken into lines.
#include "terminal/message.h"

#include <gtest/gtest.h>

#include <sstream>

namespace qduino::apps::wrap_test {
namespace {

/// What a shell makes of the lines: a backslash at the end joins the next one.
std::string read_by_shell(const std::string& lines, std::size_t prefix) {
    std::istringstream in{lines};
    std::string command;
    for (std::string line; std::getline(in, line);) {
        line.erase(0, prefix);
        const bool goes_on = !line.empty() && line.back() == '\\';
        if (goes_on) line.pop_back();
        command += line;
        if (!goes_on) command += '\n';
    }
    return command;
}

TEST(Wrap, KeepsShortTextOnOneLine) { EXPECT_EQ(wrapped("two words", "> "), "> two words\n"); }

TEST(Wrap, PiecesStayWhole) {
    const std::string piece = "loop 11 5.8 ms,";
    EXPECT_EQ(wrapped(std::vector<std::string>(6, piece), "  "),
              "  " + piece + " " + piece + " " + piece + " " + piece + "\n  " + piece + " " + piece + "\n");
}

TEST(Wrap, IndentsFurtherLines) {
    const std::string word(30, 'x');
    EXPECT_EQ(wrapped(word + " " + word + " " + word, "why  "),
              "why  " + word + " " + word + "\n     " + word + "\n");
}

TEST(Wrap, ACommandCanBeCopied) {
    const std::string command =
        "sudo sed -i 's/^GRUB_CMDLINE_LINUX=\"/&nohz_full=1 /' /etc/default/grub && sudo update-grub && sudo "
        "reboot";
    const std::string lines = wrapped_command(command, "   fix  ");
    EXPECT_GT(std::count(lines.begin(), lines.end(), '\n'), 1);
    EXPECT_EQ(read_by_shell(lines, 8), command + "\n");
}

TEST(Wrap, NeverBreaksInQuotes) {
    const std::string quoted =
        "'" + std::string(20, 'a') + " " + std::string(20, 'b') + " " + std::string(20, 'c') + "'";
    EXPECT_NE(wrapped_command("sudo echo and a few words more to fill it " + quoted, "").find(quoted),
              std::string::npos);
}

TEST(Wrap, OrdinaryTextHasNoBackslashes) {
    const std::string text(200, 'y');
    EXPECT_EQ(wrapped_command("run it on another board " + text, "").find('\\'), std::string::npos);
}

}  // namespace
}  // namespace qduino::apps::wrap_test
