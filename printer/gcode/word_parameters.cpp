#include "printer/gcode/word_parameters.h"

#include <algorithm>

#include "printer/gcode/text.h"

namespace qduino::printer::gcode {
namespace {

/// `KEY=VALUE`, or a bare word, off the front of `text`, which holds no leading blanks.
struct Pair {
    std::string_view key;
    std::optional<std::string_view> value{};
};

Pair take_pair(std::string_view& text) {
    const auto until = [&](auto ends) {
        const auto end = std::ranges::find_if(text, ends);
        const std::string_view piece = text.substr(0, static_cast<std::size_t>(end - text.begin()));
        text.remove_prefix(piece.size());
        return piece;
    };
    Pair pair{until([](char c) { return c == '=' || is_space(c); })};
    if (text.empty() || text.front() != '=') return pair;
    text.remove_prefix(1);
    const char quote = !text.empty() && (text.front() == '"' || text.front() == '\'') ? text.front() : '\0';
    if (quote == '\0') {
        pair.value = until(is_space);
        return pair;
    }
    text.remove_prefix(1);
    pair.value = until([quote](char c) { return c == quote; });
    if (!text.empty()) text.remove_prefix(1);
    return pair;
}

/// Where `key=` stands behind a blank or at the front, not before `from`; npos: nowhere.
std::size_t find_key(std::string_view text, std::string_view key, std::size_t from) {
    for (std::size_t at = from; at + key.size() < text.size(); ++at) {
        const bool begins = at == 0 || is_space(text[at - 1]);
        if (begins && text[at + key.size()] == '=' &&
            std::ranges::equal(text.substr(at, key.size()), key, {}, to_upper))
            return at;
    }
    return std::string_view::npos;
}

Error cut_short() {
    return make_error(ErrorCode::invalid_argument, "what follows it is longer than the ",
                      decltype(Command::text)::kCapacity, " bytes that may: the rest would be lost");
}

}  // namespace

Result<std::optional<std::string_view>> word_name(const Command& command, std::string_view key,
                                                  std::initializer_list<std::string_view> others) {
    if (command.text_cut) return cut_short();
    std::string_view name = command.text;
    const std::size_t at = find_key(name, key, 0);
    if (at == std::string_view::npos) return std::optional<std::string_view>{};
    name.remove_prefix(at + key.size() + 1);
    for (const std::string_view other : others) {
        name = name.substr(0, find_key(name, other, 1));
    }
    name = trim(name);
    const bool quoted =
        name.size() >= 2 && (name.front() == '"' || name.front() == '\'') && name.front() == name.back();
    return std::optional{quoted ? name.substr(1, name.size() - 2) : name};
}

std::optional<std::string_view> word_value(std::string_view text, std::string_view key) {
    for (text = trim(text); !text.empty(); text = trim(text)) {
        const Pair pair = take_pair(text);
        if (pair.value && std::ranges::equal(pair.key, key, {}, to_upper)) return pair.value;
    }
    return std::nullopt;
}

Result<std::optional<double>> word_number(const Command& command, std::string_view key) {
    std::optional<std::string_view> digits = word_value(command.text, key);
    // It may stand in what was cut off.
    if (!digits && command.text_cut) return cut_short();
    if (!digits) return std::optional<double>{};
    const std::string_view given = *digits;
    const auto number = take_scientific(*digits);
    if (number && digits->empty()) return number;
    return make_error(ErrorCode::invalid_argument, key, '=', given, " is not a number");
}

Result<std::optional<double>> word_number_within(const Command& command, std::string_view key, double low,
                                                 double high) {
    auto value = word_number(command, key);
    if (!value || !*value || (**value >= low && **value <= high)) return value;
    return make_error(ErrorCode::out_of_range, key, '=', Shortest{**value}, " is outside of ", Shortest{low},
                      " to ", Shortest{high});
}

}  // namespace qduino::printer::gcode
