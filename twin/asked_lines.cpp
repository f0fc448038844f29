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
        if (std::optional<CommandLine> typed = take_typed()) return typed;
        std::optional<CommandLine> command = file_.next();
        if (command) heed(*command);
        if (!command || command->word.empty() || !expand(*command)) return command;
    }
}

std::optional<CommandLine> AskedLines::take_typed() {
    if (!expanded_.empty() || typed_.empty() || typed_.front().typed->behind > file_.number())
        return std::nullopt;
    CommandLine command = std::move(typed_.front());
    typed_.pop_front();
    return command;
}

// Words are Klipper's, but for the tools that Prusa's machines ask a person for; some codes are
// RepRapFirmware's alone, and M862 names an MK3.
void AskedLines::heed(const CommandLine& command) {
    Flavour said = command.flavour;
    if (!command.word.empty() && command.word != "TX" && command.word != "TC") said = Flavour::klipper;
    if (command.letter == 'G' && command.number == 10 && command.has('P')) said = Flavour::reprap;
    if (command.letter == 'M') {
        for (const int own : {563, 566, 567, 568, 572, 584, 591, 703})
            if (command.number == own) said = Flavour::reprap;
        const bool old = command.tail.starts_with("MK2") || command.tail.starts_with("MK3");
        const bool new_board = command.tail.starts_with("MK3.5") || command.tail.starts_with("MK3.9");
        if (command.number == 862 && old && !new_board) said = Flavour::reprap;
    }
    flavour_ = std::max(flavour_, said);
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
