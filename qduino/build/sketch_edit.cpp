#include "qduino/build/sketch_edit.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include "base/text.h"
#include "posix/durable_file.h"
#include "posix/small_file.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::pair<std::string_view, std::int64_t>, 6> kUnits{{{"h", 3'600'000'000'000},
                                                                           {"min", 60'000'000'000},
                                                                           {"s", 1'000'000'000},
                                                                           {"ms", 1'000'000},
                                                                           {"us", 1'000},
                                                                           {"ns", 1}}};

/// 0: there is no such unit.
std::int64_t unit_of(std::string_view name) {
    const auto* const at = std::ranges::find(kUnits, name, &decltype(kUnits)::value_type::first);
    return at == kUnits.end() ? (name == "cycles" ? 1 : 0) : at->second;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

// ---- reading ------------------------------------------------------------------------------------

/// A stretch of a tab's text.
struct Span {
    std::size_t begin = 0;
    std::size_t end = 0;
    [[nodiscard]] std::string_view in(std::string_view text) const { return text.substr(begin, end - begin); }
};

/// loop(id, budget, period …), or attachInterruptVcpu(pin, handler, mode, budget, period …), with
/// the unit that plain numbers have there.
struct Declaration {
    bool handler = false;
    std::size_t tab = 0;
    int first_line = 0;
    int last_line = 0;
    std::vector<Span> arguments;
    Nanoseconds unit{};

    [[nodiscard]] std::size_t budget_at() const { return handler ? 3 : 1; }
};

/// Walks over the code of a tab: neither comments, nor strings, nor the preprocessor's lines.
class CodeWalk {
  public:
    explicit CodeWalk(std::string_view text) : text_(text) {}

    [[nodiscard]] bool at_end() const { return at_ >= text_.size(); }
    [[nodiscard]] std::size_t at() const { return at_; }
    [[nodiscard]] char look() const { return at_end() ? '\0' : text_[at_]; }
    /// Goes on to the next character that is code and no space.
    void skip() {
        for (;;) {
            if (is_space(look())) {
                line_begins_ = line_begins_ || look() == '\n';
                ++at_;
            } else if (!skip_comment() && !(line_begins_ && look() == '#' && skip_line())) {
                return;
            }
        }
    }
    /// The token here: a word, a number, a whole string, or one character.
    std::string_view take() {
        const std::size_t begin = at_;
        line_begins_ = false;
        if (is_letter(look())) {
            while (is_letter(look()) || is_digit(look())) ++at_;
            if (look() == '"' && text_[at_ - 1] == 'R') skip_raw_string();
        } else if (is_digit(look())) {
            while (is_letter(look()) || is_digit(look()) || look() == '.' || look() == '\'') ++at_;
        } else if (look() == '"' || look() == '\'') {
            skip_quoted(look());
        } else {
            ++at_;
        }
        at_ = std::min(at_, text_.size());
        return text_.substr(begin, at_ - begin);
    }

  private:
    [[nodiscard]] bool here(std::string_view word) const { return text_.substr(at_).starts_with(word); }
    bool skip_comment() {
        if (here("//")) return skip_line();
        if (!here("/*")) return false;
        at_ = std::min(text_.find("*/", at_ + 2), text_.size() - 2) + 2;
        return true;
    }
    /// To its end, also where a backslash continues it.
    bool skip_line() {
        while (!at_end() && look() != '\n') {
            const bool continued = look() == '\\' && (text_.substr(at_ + 1).starts_with("\n") ||
                                                      text_.substr(at_ + 1).starts_with("\r\n"));
            at_ += continued ? (text_[at_ + 1] == '\r' ? 3 : 2) : 1;
        }
        return true;
    }
    void skip_quoted(char quote) {
        for (++at_; !at_end() && look() != quote && look() != '\n'; ++at_) {
            if (look() == '\\') ++at_;
        }
        ++at_;
    }
    void skip_raw_string() {
        const std::size_t open = text_.find('(', at_);
        if (open == std::string_view::npos) return;
        const auto end = text<std::string>(')', text_.substr(at_ + 1, open - at_ - 1), '"');
        const std::size_t close = text_.find(end, open);
        at_ = close == std::string_view::npos ? text_.size() : close + end.size();
    }

    std::string_view text_;
    std::size_t at_ = 0;
    bool line_begins_ = true;
};

int line_of(std::string_view text, std::size_t at) {
    return 1 + static_cast<int>(std::ranges::count(text.substr(0, at), '\n'));
}

Span trimmed(std::string_view text, Span span) {
    while (span.begin < span.end && is_space(text[span.begin])) ++span.begin;
    while (span.end > span.begin && is_space(text[span.end - 1])) --span.end;
    return span;
}

/// The arguments between the parenthesis that `walk` is at and the one that closes it.
std::vector<Span> take_arguments(CodeWalk& walk, std::string_view text) {
    std::vector<Span> arguments;
    walk.take();
    std::size_t begin = walk.at();
    for (int depth = 1; depth > 0 && !walk.at_end();) {
        walk.skip();
        const std::size_t at = walk.at();
        const std::string_view token = walk.take();
        if (token == "(" || token == "[" || token == "{") ++depth;
        if (token == ")" || token == "]" || token == "}") --depth;
        if (depth == 0 || (depth == 1 && token == ",")) {
            arguments.push_back(trimmed(text, {begin, at}));
            begin = walk.at();
        }
    }
    return arguments;
}

/// All that looks like the declaration of a loop, or of a handler, with a budget.
std::vector<Declaration> declarations_in(const std::vector<TabText>& tabs) {
    std::vector<Declaration> found;
    std::int64_t unit = unit_of("ms");
    for (std::size_t tab = 0; tab < tabs.size(); ++tab) {
        const std::string_view text = tabs[tab].text;
        CodeWalk walk{text};
        for (walk.skip(); !walk.at_end(); walk.skip()) {
            const std::size_t begin = walk.at();
            const std::string_view word = walk.take();
            const bool handler = word == "attachInterruptVcpu";
            if (word != "loop" && word != "TIME_UNIT" && !handler) continue;
            walk.skip();
            if (walk.look() != '(') continue;
            std::vector<Span> arguments = take_arguments(walk, text);
            if (word == "TIME_UNIT" && arguments.size() == 1) unit = unit_of(arguments[0].in(text));
            const std::size_t least = handler ? 5 : 3, most = handler ? 6 : 5;
            if (word != "TIME_UNIT" && arguments.size() >= least && arguments.size() <= most)
                found.push_back({handler, tab, line_of(text, begin), line_of(text, walk.at()),
                                 std::move(arguments), Nanoseconds{unit}});
        }
    }
    return found;
}

/// A literal apart: its digits without separators, how many stand behind the point, and its suffix.
struct Literal {
    std::int64_t digits = 0;
    int decimals = 0;
    std::string_view suffix;
};

std::optional<Literal> read_literal(std::string_view word) {
    Literal literal;
    bool point = false;
    std::size_t at = 0;
    for (; at < word.size() && (is_digit(word[at]) || word[at] == '.' || word[at] == '\''); ++at) {
        if (word[at] == '\'') continue;
        if (word[at] == '.') {
            if (std::exchange(point, true)) return std::nullopt;
            continue;
        }
        if (literal.digits > 100'000'000'000'000) return std::nullopt;
        literal.digits = literal.digits * 10 + (word[at] - '0');
        literal.decimals += point ? 1 : 0;
    }
    const bool octal = word.size() > 1 && word[0] == '0' && is_digit(word[1]);
    literal.suffix = word.substr(at);
    if (at == 0 || octal || literal.decimals > 9) return std::nullopt;
    if (!literal.suffix.empty() && (literal.suffix == "cycles" || unit_of(literal.suffix) == 0))
        return std::nullopt;
    return literal;
}

/// The time that a literal stands for, rounded as the compiler's to_duration() rounds.
std::optional<Nanoseconds> value_of(std::string_view word, Nanoseconds unit) {
    const std::optional<Literal> literal = read_literal(word);
    if (!literal) return std::nullopt;
    const std::int64_t ns = literal->suffix.empty() ? unit.count() : unit_of(literal->suffix);
    auto value = static_cast<long double>(literal->digits) * static_cast<long double>(ns);
    for (int i = 0; i < literal->decimals; ++i) value /= 10;
    return Nanoseconds{static_cast<std::int64_t>(value + 0.5L)};
}

// ---- changing -----------------------------------------------------------------------------------

struct Replacement {
    std::size_t tab = 0;
    Span span;
    std::string by;
};

bool is_of(const Declaration& declaration, const std::vector<TabText>& tabs, const BudgetEdit& edit) {
    const TabText& tab = tabs[declaration.tab];
    if (declaration.handler != edit.handler) return false;
    if (declaration.arguments[0].in(tab.text) != std::to_string(edit.id)) return false;
    if (edit.handler) return true;
    std::error_code failed;
    return (fs::equivalent(tab.path, edit.file, failed) || tab.path == fs::path{edit.file}) &&
           edit.line >= declaration.first_line && edit.line <= declaration.last_line;
}

/// The one that `edit` is about; null: there is none, or more than one.
const Declaration* declaration_of(const std::vector<Declaration>& all, const std::vector<TabText>& tabs,
                                  const BudgetEdit& edit) {
    const Declaration* found = nullptr;
    for (const Declaration& declaration : all) {
        if (!is_of(declaration, tabs, edit)) continue;
        if (found) return nullptr;
        found = &declaration;
    }
    return found;
}

std::string place_of(const BudgetEdit& edit) {
    if (edit.handler) return text<std::string>("the handler of pin ", edit.id);
    return text<std::string>("loop ", edit.id, " (", fs::path{edit.file}.filename().string(), ':', edit.line,
                             ')');
}

/// Changes one number of a declaration from `was` to `to`. Returns why it cannot.
std::string replace_number(const std::vector<TabText>& tabs, const Declaration& declaration,
                           std::size_t argument, Nanoseconds was, Nanoseconds to,
                           std::vector<Replacement>& replacements) {
    if (was == to) return {};
    const Span span = declaration.arguments[argument];
    const auto word = std::string{span.in(tabs[declaration.tab].text)};
    const char* const name = argument == declaration.budget_at() ? "budget" : "period";
    const std::optional<Nanoseconds> value = value_of(word, declaration.unit);
    if (!value)
        return text<std::string>("its ", name, " is `", word, "`, not a number: make it ", to, " by hand");
    if (*value != was) {
        return text<std::string>("its ", name, " reads as ", *value, ", and the program had ", was,
                                 ": make it ", to, " by hand");
    }
    replacements.push_back({declaration.tab, span, literal_for(to, word, declaration.unit)});
    return {};
}

/// The line of `text` around `at`, without its end.
std::string_view line_at(std::string_view text, std::size_t at) {
    const std::size_t begin = at == 0 ? 0 : text.rfind('\n', at - 1) + 1;
    std::string_view line = text.substr(begin, text.find('\n', at) - begin);
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
}

std::string diff_of(const TabText& before, const TabText& after) {
    if (before.text == after.text) return {};
    const std::string name = before.path.filename().string();
    auto out = text<std::string>("--- ", name, "\n+++ ", name, '\n');
    std::size_t was = 0, is = 0;
    for (int line = 1; was < before.text.size(); ++line) {
        const std::string_view old_line = line_at(before.text, was), new_line = line_at(after.text, is);
        if (old_line != new_line)
            write(out, "@@ -", line, " +", line, " @@\n-", old_line, "\n+", new_line, '\n');
        was = std::min(before.text.find('\n', was), before.text.size() - 1) + 1;
        is = std::min(after.text.find('\n', is), after.text.size() - 1) + 1;
    }
    return out;
}

}  // namespace

std::string literal_for(Nanoseconds value, const std::string& literal, Nanoseconds unit) {
    const std::optional<Literal> old = read_literal(literal);
    const std::string_view suffix = old ? old->suffix : std::string_view{};
    std::int64_t ns = suffix.empty() ? unit.count() : unit_of(suffix);
    std::string_view name = suffix;
    if (!suffix.empty() && value.count() % ns != 0) {
        // Exact in a smaller unit; a fraction would be rounded by the compiler.
        for (const auto& [smaller, size] : kUnits) {
            if (size >= ns || value.count() % size != 0) continue;
            name = smaller;
            ns = size;
            break;
        }
    }
    std::string out = std::to_string(value.count() / ns);
    std::int64_t rest = value.count() % ns;
    if (rest != 0) out += '.';
    for (std::int64_t place = ns / 10; rest != 0; rest %= place, place /= 10)
        out += static_cast<char>('0' + rest / place);
    return out.append(name);
}

Result<std::vector<TabText>> read_tabs(const std::vector<fs::path>& paths) {
    std::vector<TabText> tabs;
    for (const fs::path& path : paths) {
        QDUINO_TRY_ASSIGN(std::string text, posix::read_small_file(path));
        tabs.push_back({path, std::move(text)});
    }
    return tabs;
}

EditedSketch edit_budgets(const std::vector<TabText>& tabs, const std::vector<BudgetEdit>& edits) {
    EditedSketch edited{.tabs = tabs, .refusals = {}, .diff = {}};
    const std::vector<Declaration> declarations = declarations_in(tabs);
    std::vector<Replacement> replacements;
    for (const BudgetEdit& edit : edits) {
        if (edit.budget == edit.budget_was && edit.period == edit.period_was) continue;
        const Declaration* at = declaration_of(declarations, tabs, edit);
        std::string why =
            edit.handler ? "no tab has one attachInterruptVcpu() with that number for it: change it by hand"
                         : "its declaration is in no tab as loop(id, budget, period): change it by hand";
        if (at) why = replace_number(tabs, *at, at->budget_at(), edit.budget_was, edit.budget, replacements);
        if (at && why.empty()) {
            why = replace_number(tabs, *at, at->budget_at() + 1, edit.period_was, edit.period, replacements);
        }
        if (!why.empty()) edited.refusals.push_back(place_of(edit) + ": " + why);
    }
    // From the end, so that the places in front stay.
    std::ranges::sort(replacements, std::greater{}, [](const Replacement& r) { return r.span.begin; });
    std::vector<TabText> after = tabs;
    for (const Replacement& r : replacements)
        after[r.tab].text.replace(r.span.begin, r.span.end - r.span.begin, r.by);
    for (std::size_t i = 0; i < tabs.size(); ++i) edited.diff += diff_of(tabs[i], after[i]);
    if (edited.refusals.empty()) edited.tabs = std::move(after);
    return edited;
}

Result<void> write_tabs(const std::vector<TabText>& before, const std::vector<TabText>& after) {
    for (const TabText& tab : before) {
        QDUINO_TRY_ASSIGN(const std::string now, posix::read_small_file(tab.path));
        if (now == tab.text) continue;
        return make_error(ErrorCode::unavailable, tab.path.filename().native(),
                          " was changed while the sketch was profiled: nothing is written; profile it again");
    }
    for (std::size_t i = 0; i < before.size(); ++i) {
        if (before[i].text == after[i].text) continue;
        std::error_code failed;
        // A link stays a link.
        const fs::path path = fs::canonical(before[i].path, failed);
        const fs::perms permissions = fs::status(path, failed).permissions();
        QDUINO_TRY(posix::write_durably(path, after[i].text));
        fs::permissions(path, permissions, failed);
        posix::give_to_owner_of_folder(path);
    }
    return {};
}

}  // namespace qduino::apps
