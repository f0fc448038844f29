#include "printer/gcode/parser.h"

#include "printer/gcode/lexer.h"

namespace qduino::printer::gcode {
const Line* Parser::parse() {
    line_.command = nullptr;
    if (line_.error || line_.code.empty()) return &line_;
    const Result<bool> words = parse_words(line_.code, command_);
    if (!words) {
        line_.error = at_place(words.error(), line_.source);
    } else if (*words) {
        command_.source = line_.source;
        line_.command = &command_;
    }
    return &line_;
}

Result<std::optional<Command>> parse_line(std::string_view text) {
    Parser parser;
    std::span<const char> input{text.data(), text.size()};
    const Line* line = parser.next(input);
    if (line == nullptr) line = parser.finish();
    if (line == nullptr) return std::optional<Command>{};
    if (line->error) return *line->error;
    const bool one_line = input.empty() || (input.size() == 1 && text.ends_with("\r\n"));
    if (!one_line) return make_error(ErrorCode::invalid_argument, "more than one line");
    return line->command == nullptr ? std::optional<Command>{} : std::optional<Command>{*line->command};
}

}  // namespace qduino::printer::gcode
