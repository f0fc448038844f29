#include "config/toml_section.h"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <sstream>

#include "base/whole_number.h"

namespace qduino::apps {
namespace {

constexpr std::pair<std::string_view, std::int64_t> kUnits[] = {{"ns", 1},
                                                                {"us", 1'000},
                                                                {"µs", 1'000},
                                                                {"ms", 1'000'000},
                                                                {"s", 1'000'000'000},
                                                                {"min", 60'000'000'000},
                                                                {"h", 3'600'000'000'000}};

std::string_view trimmed(std::string_view text) {
    const std::size_t first = std::min(text.find_first_not_of(' '), text.size());
    return text.substr(first, text.find_last_not_of(' ') + 1 - first);
}

/// Takes the digits off the front of `text`.
std::string_view take_digits(std::string_view& text) {
    const std::string_view digits = text.substr(0, text.find_first_not_of("0123456789"));
    text.remove_prefix(digits.size());
    return digits;
}

/// 0.`digits` of `unit_ns`, when that is a whole number.
std::optional<std::int64_t> fraction_of(std::int64_t unit_ns, std::string_view digits) {
    digits = digits.substr(0, digits.find_last_not_of('0') + 1);
    if (digits.size() > 15) return std::nullopt;  // finer than a nanosecond, whatever the unit
    std::int64_t scale = 1;
    for (std::size_t i = 0; i < digits.size(); ++i) scale *= 10;
    const std::int64_t common = std::gcd(unit_ns, scale);
    const std::int64_t value = whole_number<std::int64_t>(digits).value_or(0), divisor = scale / common;
    if (value % divisor != 0) return std::nullopt;
    return unit_ns / common * (value / divisor);
}

/// A value as it stands in the file; for a table or an array only its kind.
std::string spelled(const toml::node& node) {
    if (node.is_table()) return "a table";
    if (node.is_array()) return "a list";
    std::ostringstream out;
    node.visit([&](const auto& value) {
        if constexpr (toml::is_value<decltype(value)>) out << value;
    });
    return out.str();
}

/// A key without the unit that it ends with: "max_speed_mm_s" and "max_speed_mm_min" have the same.
std::string_view without_unit(std::string_view key) {
    constexpr std::string_view kParts[] = {"mm", "cm",      "um",  "m",   "s",   "s2",   "ms",      "us",
                                           "ns", "min",     "h",   "w",   "mw",  "kw",   "j",       "k",
                                           "hz", "celsius", "ohm", "mm2", "mm3", "kohm", "degrees", "c"};
    while (true) {
        const std::size_t cut = key.rfind('_');
        if (cut == std::string_view::npos) return key;
        if (std::ranges::find(kParts, key.substr(cut + 1)) == std::end(kParts)) return key;
        key = key.substr(0, cut);
    }
}

}  // namespace

std::optional<Nanoseconds> parse_duration(std::string_view text) {
    text = trimmed(text);
    const auto whole = whole_number<std::int64_t>(take_digits(text));
    std::string_view fraction = "0";
    if (text.starts_with('.')) {
        text.remove_prefix(1);
        fraction = take_digits(text);
    }
    const auto* const unit = std::ranges::find(kUnits, trimmed(text), [](auto& each) { return each.first; });
    if (!whole || fraction.empty() || unit == std::end(kUnits)) return std::nullopt;
    const std::optional<std::int64_t> rest = fraction_of(unit->second, fraction);
    std::int64_t ns = 0;
    if (!rest || __builtin_mul_overflow(*whole, unit->second, &ns) || __builtin_add_overflow(ns, *rest, &ns))
        return std::nullopt;
    return Nanoseconds{ns};
}

const toml::node* TomlSection::take(const char* key) {
    known_.emplace_back(key);
    return table_.get(key);
}

std::string TomlSection::path_of(std::string_view key) const {
    std::string path = title_;
    std::erase_if(path, [](char c) { return c == '[' || c == ']'; });
    return path.empty() ? std::string(key) : path + "." + std::string(key);
}

void TomlSection::say(const toml::node& node, const std::string& what) {
    if (!reading_.error.empty()) return;
    write(reading_.error, reading_.file, ':', node.source().begin.line, ": ", title_,
          title_.empty() ? "" : " ", what);
}

void TomlSection::blame(const toml::node& node, std::string_view key, const std::string& accepted) {
    say(node, "'" + std::string(key) + "' is " + spelled(node) + "; accepted: " + accepted);
}

void TomlSection::number(const char* key, double& value, double minimum, double maximum) {
    const toml::node* node = take(key);
    if (!node) return;
    const std::optional<double> given = node->value<double>();
    if (!given || !node->is_number() || !(*given >= minimum && *given <= maximum)) {
        return blame(
            *node, key,
            qduino::text<std::string>("a number from ", Shortest{minimum}, " to ", Shortest{maximum}));
    }
    value = *given;
}

void TomlSection::flag(const char* key, bool& value) {
    value = read<bool>(key, "true or false", [](bool) { return true; }).value_or(value);
}

void TomlSection::text(const char* key, std::string& value) {
    const auto fits = [](const std::string& given) { return !given.empty(); };
    value = read<std::string>(key, "a text in quotes", fits).value_or(value);
}

void TomlSection::duration(const char* key, Nanoseconds& value, Nanoseconds minimum) {
    std::string accepted = "a duration in quotes with its unit, such as \"4 ms\" (ns, us, ms, s, min or h)";
    if (minimum > Nanoseconds{0}) write(accepted, ", at least ", minimum.count(), " ns");
    const auto fits = [&](const std::string& given) { return parse_duration(given) >= minimum; };
    if (const auto given = read<std::string>(key, accepted, fits)) value = *parse_duration(*given);
}

void TomlSection::instant(const char* key, Instant& value) {
    Nanoseconds after = value - kEpoch;
    duration(key, after);
    value = kEpoch + after;
}

void TomlSection::require(const char* key) {
    if (!table_.contains(key)) say(table_, "needs '" + std::string(key) + "'");
}

void TomlSection::fault(const char* key, const std::string& what) {
    const toml::node* node = table_.get(key);
    say(node ? *node : table_, "'" + std::string(key) + "' " + what);
}

std::string place_in_toml(std::string_view text, std::string_view name, std::string_view path) {
    const toml::table table = toml::parse(text);
    std::uint32_t line = 0;
    for (std::string_view here = path; !here.empty() && line == 0;) {
        if (const toml::node* node = table.at_path(here).node()) line = node->source().begin.line;
        const std::size_t dot = here.rfind('.');
        here = here.substr(0, dot == std::string_view::npos ? 0 : dot);
    }
    return line == 0 ? qduino::text<std::string>(name, ": ")
                     : qduino::text<std::string>(name, ':', line, ": ");
}

void TomlSection::finish() {
    for (const auto& [key, node] : table_) {
        if (std::ranges::find(known_, key.str()) != known_.end()) continue;
        std::string accepted;
        for (const std::string& known : known_) accepted += (accepted.empty() ? "" : ", ") + known;
        const auto other_unit = std::ranges::find_if(known_, [&, name = key.str()](const std::string& known) {
            return without_unit(known) == without_unit(name);
        });
        if (other_unit != known_.end()) {
            say(node,
                "'" + std::string(key.str()) + "' is not known: is it '" + *other_unit + "', in that unit?");
        }
        say(node, "'" + std::string(key.str()) + "' is not known; accepted: " + accepted);
    }
}

Error toml_error(std::string_view text, std::string_view advice) {
    constexpr std::size_t kRoom = decltype(Error::message)::kCapacity;
    const std::size_t list = text.find("; accepted: ");
    if (text.size() + advice.size() > kRoom && list != std::string_view::npos) {
        std::size_t entries = 1;
        for (std::size_t at = text.find(", ", list); at != std::string_view::npos;
             at = text.find(", ", at + 1))
            ++entries;
        const auto end = qduino::text<std::string>(", … (", entries, " in all)", advice);
        const std::size_t cut = end.size() < kRoom ? text.rfind(", ", kRoom - end.size()) : 0;
        if (cut > list && cut != std::string_view::npos)
            return make_error(ErrorCode::invalid_argument, text.substr(0, cut), end);
    }
    return make_error(ErrorCode::invalid_argument, text, advice);
}

}  // namespace qduino::apps
