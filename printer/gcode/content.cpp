#include "printer/gcode/content.h"

#include <algorithm>

#include "printer/gcode/command_table.h"
#include "printer/gcode/parser.h"

namespace qduino::printer::gcode {
namespace {

/// Control characters that text does not have: all below space except tab, line feed, vertical tab,
/// form feed, CR; and DEL.
bool is_binary(char c) {
    const auto byte = static_cast<unsigned char>(c);
    return (byte < 0x20 && !(byte >= 0x09 && byte <= 0x0D)) || byte == 0x7F;
}

/// Counts the lines that speak for G-code, and the others.
struct Tally {
    void operator()(const Line& line) {
        if (line.error) ++others;
        if (line.command != nullptr) ++(find_code(*line.command) != nullptr ? known : others);
        if (line.command == nullptr && !line.error && !line.comment.empty()) ++comments;
    }
    int known = 0;     ///< commands in the table
    int comments = 0;  ///< lines that are a `;` comment
    int others = 0;    ///< lines that are neither
};

}  // namespace

Content look_at_content(std::span<const char> bytes) {
    const std::string_view text{bytes.data(), bytes.size()};
    if (text.starts_with("GCDE")) return Content::binary_gcode;
    if (std::any_of(bytes.begin(), bytes.end(), is_binary)) return Content::binary;
    if (text.find_first_not_of(" \t\r\n\v\f") == std::string_view::npos) return Content::empty;
    Parser parser;
    Tally tally;
    parser.feed(bytes, tally);
    // The last line is cut wherever the caller's buffer ended: it counts only when no other line
    // does.
    if (tally.known + tally.comments + tally.others == 0) parser.finish(tally);
    return tally.known + tally.comments > tally.others ? Content::gcode : Content::other_text;
}

std::string_view explain(Content content) {
    switch (content) {
        case Content::gcode:
            return {};
        case Content::empty:
            return "The file is empty.";
        case Content::binary_gcode:
            return "This is binary G-code (.bgcode). Switch off \"Supports binary G-code\" in the slicer's "
                   "printer "
                   "settings, or convert the file, and send it again.";
        case Content::binary:
            return "This is a binary file, not G-code. Slice the model first.";
        case Content::other_text:
            return "This is a text, but not G-code: its first lines hold no command.";
    }
    return {};
}

}  // namespace qduino::printer::gcode
