#include "report/picture/svg.h"

namespace qduino::apps::picture {
namespace {

/// Bytes of the UTF-8 character at the start of `text`; 0: it is none (RFC 3629).
std::size_t utf8_length(std::string_view text) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const unsigned char first = byte(0);
    const std::size_t length = first < 0x80   ? 1
                               : first < 0xC2 ? 0
                               : first < 0xE0 ? 2
                               : first < 0xF0 ? 3
                               : first < 0xF5 ? 4
                                              : 0;
    if (length == 0 || text.size() < length) return 0;
    for (std::size_t i = 1; i < length; ++i) {
        if ((byte(i) & 0xC0) != 0x80) return 0;
    }
    const bool overlong = (first == 0xE0 && byte(1) < 0xA0) || (first == 0xF0 && byte(1) < 0x90);
    const bool surrogate = first == 0xED && byte(1) >= 0xA0;
    const bool too_high = first == 0xF4 && byte(1) >= 0x90;
    // U+FFFE and U+FFFF.
    const bool no_character = first == 0xEF && byte(1) == 0xBF && byte(2) >= 0xBE;
    return overlong || surrogate || too_high || no_character ? 0 : length;
}

std::string_view entity(char c) {
    switch (c) {
        case '&':
            return "&amp;";
        case '<':
            return "&lt;";
        case '>':
            return "&gt;";
        case '"':
            return "&quot;";
        case '\'':
            return "&#39;";
        default:
            return {};
    }
}

}  // namespace

std::string escaped(std::string_view text) {
    std::string out;
    while (!text.empty()) {
        const std::size_t length = utf8_length(text);
        const bool control = static_cast<unsigned char>(text[0]) < ' ' || text[0] == 0x7f;
        if (length == 0 || control) {
            out += '?';
        } else if (const std::string_view named = entity(text[0]); !named.empty()) {
            out += named;
        } else {
            out += text.substr(0, length);
        }
        text.remove_prefix(length == 0 ? 1 : length);
    }
    return out;
}

std::string shortened(std::string_view text, std::size_t most) {
    std::size_t count = 0, kept = 0;
    for (std::size_t at = 0; at < text.size(); ++count) {
        if (count + 1 == most) kept = at;
        const std::size_t length = utf8_length(text.substr(at));
        at += length == 0 ? 1 : length;
    }
    return count <= most ? std::string(text) : std::string(text.substr(0, kept)) + "…";
}

Svg::Svg(int width, int height, std::string_view style, std::string_view definitions,
         std::string_view attributes) {
    write(out_,
          "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"",
          width, "\" height=\"", height, "\" viewBox=\"0 0 ", width, ' ', height, "\" ", attributes,
          ">\n<style>", style, "</style>\n<defs>", definitions, "</defs>\n");
    rectangle("page", 0, 0, width, height);
}

void Svg::shape_end(std::string_view element, std::string_view title) {
    if (title.empty()) {
        out_ += "/>\n";
        return;
    }
    write(out_, "><title>", escaped(title), "</title></", element, ">\n");
}

void Svg::rectangle(std::string_view kind, double x, double y, double width, double height,
                    std::string_view title) {
    write(out_, "<rect class=\"", kind, "\" x=\"", point(x), "\" y=\"", point(y), "\" width=\"", point(width),
          "\" height=\"", point(height), '"');
    shape_end("rect", title);
}

void Svg::line(std::string_view kind, double x1, double y1, double x2, double y2) {
    write(out_, "<line class=\"", kind, "\" x1=\"", point(x1), "\" y1=\"", point(y1), "\" x2=\"", point(x2),
          "\" y2=\"", point(y2), "\"/>\n");
}

void Svg::path(std::string_view kind, std::string_view d, std::string_view title) {
    write(out_, "<path class=\"", kind, "\" d=\"", d, '"');
    shape_end("path", title);
}

void Svg::image(double x, double y, double width, double height, std::string_view address) {
    write(out_, "<image x=\"", point(x), "\" y=\"", point(y), "\" width=\"", point(width), "\" height=\"",
          point(height), "\" href=\"", address, "\"/>\n");
}

void Svg::words(std::string_view kind, double x, double y, std::string_view text) {
    write(out_, "<text class=\"", kind, "\" x=\"", point(x), "\" y=\"", point(y), "\">", escaped(text),
          "</text>\n");
}

void Svg::begin_group(std::string_view kind, std::string_view attributes, std::string_view title) {
    write(out_, "<g class=\"", kind, '"', attributes.empty() ? "" : " ", attributes, ">\n");
    if (!title.empty()) write(out_, "<title>", escaped(title), "</title>\n");
}

std::string Svg::finish() { return out_ += "</svg>\n"; }

}  // namespace qduino::apps::picture
