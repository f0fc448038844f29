#include "apps/toml/toml_section.h"

#include <algorithm>
#include <optional>
#include <sstream>

#include "apps/toml/duration.h"

namespace qduino::apps {
namespace {

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

/// The shortest form: 100000 rather than 100000.000000.
std::string spelled(double number) {
    std::ostringstream out;
    out.precision(12);
    out << number;
    return out.str();
}

}  // namespace

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
    reading_.error = reading_.file + ":" + std::to_string(node.source().begin.line) + ": " + title_ +
                     (title_.empty() ? "" : " ") + what;
}

void TomlSection::blame(const toml::node& node, std::string_view key, const std::string& accepted) {
    say(node, "'" + std::string(key) + "' is " + spelled(node) + "; accepted: " + accepted);
}

void TomlSection::number(const char* key, double& value, double minimum, double maximum) {
    const toml::node* node = take(key);
    if (!node) return;
    const std::optional<double> given = node->value<double>();
    if (!given || !node->is_number() || !(*given >= minimum && *given <= maximum)) {
        return blame(*node, key, "a number from " + spelled(minimum) + " to " + spelled(maximum));
    }
    value = *given;
}

void TomlSection::flag(const char* key, bool& value) {
    const toml::node* node = take(key);
    if (!node) return;
    const std::optional<bool> given = node->value_exact<bool>();
    if (!given) return blame(*node, key, "true or false");
    value = *given;
}

void TomlSection::text(const char* key, std::string& value) {
    const toml::node* node = take(key);
    if (!node) return;
    const std::optional<std::string> given = node->value_exact<std::string>();
    if (!given || given->empty()) return blame(*node, key, "a text in quotes");
    value = *given;
}

void TomlSection::duration(const char* key, Nanoseconds& value, Nanoseconds minimum) {
    const toml::node* node = take(key);
    if (!node) return;
    const std::optional<std::string> given = node->value_exact<std::string>();
    const std::optional<Nanoseconds> read = given ? parse_duration(*given) : std::nullopt;
    if (!read || *read < minimum) {
        const std::string least =
            minimum > Nanoseconds{0} ? ", at least " + std::to_string(minimum.count()) + " ns" : "";
        return blame(*node, key,
                     "a duration in quotes with its unit, such as \"4 ms\" (" + std::string(kDurationUnits) +
                         ")" + least);
    }
    value = *read;
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

void TomlSection::finish() {
    for (const auto& [key, node] : table_) {
        if (std::find(known_.begin(), known_.end(), key.str()) != known_.end()) continue;
        std::string accepted;
        for (const std::string& known : known_) accepted += (accepted.empty() ? "" : ", ") + known;
        say(node, "'" + std::string(key.str()) + "' is not known; accepted: " + accepted);
    }
}

}  // namespace qduino::apps
