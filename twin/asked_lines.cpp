#include "twin/asked_lines.h"

#include <algorithm>
#include <sstream>

namespace qduino::twin {
namespace {

/// `line` with the values of `call` in it.
std::string filled(std::string line, const CommandLine& call) {
    for (std::size_t open = line.find('{'); open != std::string::npos; open = line.find('{', open)) {
        const std::size_t close = line.find('}', open);
        if (close == std::string::npos) return line;
        const std::string parameter = line.substr(open + 1, close - open - 1);
        const std::size_t equals = std::min(parameter.find('='), parameter.size());
        const std::string otherwise = equals < parameter.size() ? parameter.substr(equals + 1) : "";
        const std::string value{call.word_value(parameter.substr(0, equals)).value_or(otherwise)};
        line.replace(open, close + 1 - open, value);
        open += value.size();
    }
    return line;
}

}  // namespace

std::optional<CommandLine> AskedLines::next() {
    for (;;) {
        if (!expanded_.empty()) {
            CommandLine command = std::move(expanded_.front());
            expanded_.pop_front();
            return command;
        }
        if (!typed_.empty() && typed_.front().first <= file_.number()) {
            CommandLine command = std::move(typed_.front().second);
            typed_.pop_front();
            return command;
        }
        std::optional<CommandLine> command = file_.next();
        if (!command || command->word.empty() || !expand(*command)) return command;
    }
}

bool AskedLines::expand(const CommandLine& call) {
    const auto macro = std::ranges::find(macros_, call.word, &MacroSpec::name);
    if (macro == macros_.end()) return false;
    std::istringstream lines{macro->text};
    for (std::string line; std::getline(lines, line);)
        expanded_.push_back(LineReader::parse(filled(line, call)));
    return true;
}

}  // namespace qduino::twin
