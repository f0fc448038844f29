#include "qduino/ide/ide_tool.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "base/whole_number.h"
#include "posix/small_file.h"

namespace qduino::apps {
namespace {

constexpr int kVersion = 1;
/// Longer lines are no commands.
constexpr std::size_t kLineMax = 4096;

/// HELLO <PROTOCOL_VERSION> "<USER_AGENT>"
bool is_hello(const Words& words) {
    const auto version = words.size() == 3 ? whole_number<int>(words[1]) : std::nullopt;
    return version && *version >= kVersion;
}

std::string command_error(const std::string& reason) { return tool_error("command_error", reason); }

/// The lines that have ended leave `begun`. Each is answered; after QUIT nothing is.
std::string answers_to_lines(IdeTool& tool, std::string& begun) {
    std::string answers;
    for (std::size_t end = 0; !tool.quits() && (end = begun.find('\n')) != std::string::npos;) {
        answers += tool.answer_to(std::string_view(begun).substr(0, end));
        begun.erase(0, end + 1);
    }
    if (begun.size() > kLineMax) begun.erase(kLineMax);
    return answers;
}

}  // namespace

Words words_of_command(std::string_view line) {
    constexpr std::string_view kBlanks = " \t\r";
    Words words;
    for (;;) {
        line.remove_prefix(std::min(line.find_first_not_of(kBlanks), line.size()));
        if (line.empty()) return words;
        const bool quoted = line.front() == '"';
        if (quoted) line.remove_prefix(1);
        const std::size_t end = quoted ? line.find('"') : line.find_first_of(kBlanks);
        words.emplace_back(line.substr(0, end));
        line.remove_prefix(std::min(end, line.size()));
        if (quoted && !line.empty()) line.remove_prefix(1);
    }
}

std::string tool_message(const nlohmann::json& message) {
    return message.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string tool_answer(std::string_view event) {
    return tool_message({{"eventType", event}, {"message", "OK"}});
}

std::string tool_error(std::string_view event, std::string_view reason) {
    return tool_message({{"eventType", event}, {"error", true}, {"message", reason}});
}

std::string IdeTool::answer_to(std::string_view line) {
    const Words words = words_of_command(line);
    if (words.empty()) return command_error("A command was expected");
    quits_ = words[0] == "QUIT";
    if (quits_) return tool_answer("quit");
    if (words[0] == "HELLO" && !greeted_ && is_hello(words)) {
        greeted_ = true;
        return tool_message({{"eventType", "hello"}, {"protocolVersion", kVersion}, {"message", "OK"}});
    }
    if (!greeted_) return command_error("The first command is HELLO, with a version and a name");
    const std::string answer = carry_out(words);
    return !answer.empty() ? answer : command_error("Unknown command " + std::string(line));
}

Result<int> run_ide_tool(IdeTool& tool) {
    ::signal(SIGPIPE, SIG_IGN);
    std::string begun;
    while (!tool.quits()) {
        std::vector<pollfd> looks{{STDIN_FILENO, POLLIN, 0}};
        for (const pollfd& wait : tool.waits()) looks.push_back(wait);
        if (::poll(looks.data(), looks.size(), -1) <= 0) continue;
        std::string answers = tool.serve(std::span(looks).subspan(1));
        if (looks[0].revents != 0) {
            std::array<char, 4096> bytes;
            const auto count = posix::read_some(STDIN_FILENO, bytes, "the commands");
            if (!count || *count == 0) return 0;  // the IDE has gone
            begun.append(bytes.data(), *count);
            answers += answers_to_lines(tool, begun);
        }
        QDUINO_TRY(posix::write_all(STDOUT_FILENO, answers, "the answer"));
    }
    return 0;
}

}  // namespace qduino::apps
