// One table of a TOML file: takes keys out by name and range. Blames wrong keys, and keys that the
// reader did not take, with file, line, key and what is accepted.
//
//   [sim]                              TomlSection sim{table, "[sim]", reading};
//   cores = 2                          sim.integer("cores", config.cores, 1, 64);
//   core = 3                           sim.finish();
//                                      b.toml:3: [sim] 'core' is not known; accepted: cores
//
// The first error is kept, and the rest of the file is read as if it were right. An absent key
// leaves its value alone.
#pragma once

#include <toml++/toml.h>

#include <array>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/fixed_string.h"
#include "base/result.h"
#include "base/time.h"
#include "base/words.h"
#include "posix/small_file.h"

namespace qduino::apps {

/// A duration as people write it: "4 ms", "90us", "1.5 s". A decimal number, not negative, and its
/// unit; blanks between them are welcome. Nothing when `text` is anything else, is finer than a
/// nanosecond, or is longer than 292 years. Exact: no floating point on the way.
[[nodiscard]] std::optional<Nanoseconds> parse_duration(std::string_view text);

/// Shared by all tables of one file.
struct TomlReading {
    std::string file;   ///< as named in messages
    std::string error;  ///< the first one; empty: none
};

class TomlSection {
  public:
    /// `title` as in the file: "[sim]", "[[gpio]]"; empty for the file itself. All outlive the
    /// section.
    TomlSection(const toml::table& table, std::string title, TomlReading& reading)
        : table_(table), title_(std::move(title)), reading_(reading) {}

    template <typename T>
    void integer(const char* key, T& value, std::int64_t minimum, std::int64_t maximum) {
        const auto given = read<std::int64_t>(
            key, qduino::text<std::string>("a whole number from ", minimum, " to ", maximum),
            [=](std::int64_t number) { return number >= minimum && number <= maximum; });
        if (given) value = static_cast<T>(*given);
    }
    /// From `minimum` to `maximum`, both included.
    void number(const char* key, double& value, double minimum, double maximum);
    /// A quantity, in the unit that the key ends with.
    template <typename Quantity>
    void number(const char* key, Quantity& value, double minimum, double maximum) {
        double given = value.value();
        number(key, given, minimum, maximum);
        value = Quantity{given};
    }
    void number(const char* key, Nanoseconds& value, double minimum_s, double maximum_s) {
        double given_s = to_seconds(value);
        number(key, given_s, minimum_s, maximum_s);
        value = from_seconds(given_s);
    }
    void flag(const char* key, bool& value);
    void text(const char* key, std::string& value);
    template <std::size_t N>
    void text(const char* key, FixedString<N>& value) {
        std::string given{value.view()};
        text(key, given);
        value.assign(given);
    }
    /// "4 ms"; not shorter than `minimum`.
    void duration(const char* key, Nanoseconds& value, Nanoseconds minimum = Nanoseconds{0});
    /// "10 s" after the start.
    void instant(const char* key, Instant& value);
    template <auto kFirst, decltype(kFirst) kLast>
    void choice(const char* key, decltype(kFirst)& value, const qduino::Words<kFirst, kLast>& words) {
        const toml::node* node = take(key);
        if (!node) return;
        const auto given = node->value_exact<std::string>();
        std::string accepted;
        for (std::size_t i = 0; i < words.kCount; ++i) {
            const auto meaning = static_cast<decltype(kFirst)>(static_cast<std::size_t>(kFirst) + i);
            if (given == words(meaning)) {
                value = meaning;
                return;
            }
            write(accepted, accepted.empty() ? "\"" : ", \"", words(meaning), '"');
        }
        blame(*node, key, accepted);
    }
    [[nodiscard]] bool has(const char* key) const { return table_.contains(key); }
    /// The table must have this key.
    void require(const char* key);

    /// [title.key]: `read` gets its section.
    template <typename Read>
    void table(const char* key, Read read) {
        const toml::node* node = take(key);
        if (!node) return;
        const toml::table* inner = node->as_table();
        if (!inner) return blame(*node, key, "a table, [" + path_of(key) + "]");
        TomlSection section{*inner, "[" + path_of(key) + "]", reading_};
        read(section);
        section.finish();
    }
    /// [[title.key]]: each is an entry of `list`, and must have the keys of `required`; `read` gets
    /// its section and the entry.
    template <typename Entry, typename Read>
    void tables(const char* key, std::vector<Entry>& list, std::initializer_list<const char*> required,
                Read read) {
        const toml::node* node = take(key);
        if (!node) return;
        const toml::array* listed = node->as_array();
        if (!listed || !listed->is_array_of_tables()) {
            return blame(*node, key, "tables, each begun with [[" + path_of(key) + "]]");
        }
        for (const toml::node& entry : *listed) {
            TomlSection section{*entry.as_table(), "[[" + path_of(key) + "]]", reading_};
            for (const char* name : required) section.require(name);
            read(section, list.emplace_back());
            section.finish();
        }
    }

    /// Every key of the table, in alphabetical order; each must be a text. `take_text(key, text)`
    /// returns what is wrong with it ("is too long"), or nothing.
    template <typename Take>
    void each_text(Take take_text) {
        for (auto entry = table_.begin(); entry != table_.end(); ++entry) {
            const toml::node& node = entry->second;
            known_.emplace_back(entry->first.str());
            const auto given = node.value_exact<std::string>();
            if (!given) {
                blame(node, known_.back(), "a text");
                continue;
            }
            const std::string wrong = take_text(known_.back(), *given);
            if (!wrong.empty()) say(node, "'" + known_.back() + "' " + wrong);
        }
    }

    /// Blames `key` (or the table, if it has no such key) in the words of `what`: a rule between
    /// keys is broken.
    void fault(const char* key, const std::string& what);
    /// Blames the first key that was not taken. table() and tables() finish the tables within.
    void finish();

  private:
    const toml::node* take(const char* key);
    /// The value of `key`, which must be a T that `fits`; otherwise it is blamed with `accepted`.
    template <typename T, typename Fits>
    [[nodiscard]] std::optional<T> read(const char* key, const std::string& accepted, Fits fits) {
        const toml::node* node = take(key);
        if (!node) return std::nullopt;
        const std::optional<T> given = node->value_exact<T>();
        if (given && fits(*given)) return given;
        blame(*node, key, accepted);
        return std::nullopt;
    }
    [[nodiscard]] std::string path_of(std::string_view key) const;
    void blame(const toml::node& node, std::string_view key, const std::string& accepted);
    void say(const toml::node& node, const std::string& what);

    const toml::table& table_;
    std::string title_;
    TomlReading& reading_;
    std::vector<std::string> known_;
};

/// "NAME:LINE: " for a message about `path` ("axes.x.minimum_mm"), or about the table around it
/// where the key itself is left out; "NAME: " where neither is in the file. `text` must be TOML.
[[nodiscard]] std::string place_in_toml(std::string_view text, std::string_view name, std::string_view path);

/// Parses `text`, which messages call `name`, and hands the section of the whole file to `read`.
/// Returns the first error, with file and line; empty: none.
template <typename Read>
[[nodiscard]] std::string read_toml(std::string_view text, std::string_view name, Read read) {
    TomlReading reading{.file = std::string(name), .error = {}};
    try {
        const toml::table table = toml::parse(text);
        TomlSection root{table, "", reading};
        read(root);
        root.finish();
    } catch (const toml::parse_error& failed) {
        write(reading.error, reading.file, ':', failed.source().begin.line, ": ", failed.description());
    }
    return std::move(reading.error);
}

/// What read_toml() returned as an Error, whose text is bounded. A list of what is accepted that is
/// too long ends behind one of its entries, and says how many there are: "…; accepted: x, y, …
/// (23 in all)". `advice` stands behind it, whole.
[[nodiscard]] Error toml_error(std::string_view text, std::string_view advice = {});

}  // namespace qduino::apps
