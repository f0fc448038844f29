#include "printer/gcode/parser.h"

#include "printer/gcode/lexer.h"
#include "printer/gcode/text.h"

namespace qduino::printer::gcode {
namespace {

Error at_place(const Error& error, const Source& source) {
    Error placed{error.code, "line "};
    append_integer(placed.message, static_cast<std::int64_t>(source.line)).append(", byte ");
    append_integer(placed.message, static_cast<std::int64_t>(source.offset)).append(": ");
    placed.message.append(error.message);
    return placed;
}

}  // namespace

const Line* Parser::next(std::span<const char>& input) {
    return reader_.next(input, raw_) ? parse() : nullptr;
}

const Line* Parser::finish() { return reader_.finish(raw_) ? parse() : nullptr; }

void Parser::feed(std::span<const char> input, LineSink& sink) {
    while (const Line* line = next(input)) sink.on_line(*line);
}

void Parser::finish(LineSink& sink) {
    if (const Line* line = finish()) sink.on_line(*line);
}

const Line* Parser::parse() {
    line_.command = nullptr;
    line_.text = raw_.text;
    line_.comment = raw_.comment;
    line_.comment_cut = raw_.comment_cut;
    line_.frame = raw_.frame;
    line_.error = raw_.error;
    line_.source = raw_.source;
    if (line_.error || raw_.code.empty()) return &line_;
    const Result<bool> words = parse_words(raw_.code, command_);
    if (!words) {
        line_.error = at_place(words.error(), raw_.source);
    } else if (*words) {
        command_.source = raw_.source;
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
