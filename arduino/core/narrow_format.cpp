#include "arduino/core/narrow_format.h"

#include <cstring>
#include <string_view>

namespace qduino::arduino {
namespace {

/// One conversion: from its '%' to behind its letter. `single_l`: offset of an `l` to be left out;
/// 0: there is none.
struct Conversion {
    std::size_t length = 0;
    std::size_t single_l = 0;
};

/// Behind the ']' of "%[]a-z]"; `at` is behind the '['.
std::size_t behind_set(std::string_view text, std::size_t at) {
    if (at < text.size() && text[at] == '^') ++at;
    if (at < text.size() && text[at] == ']') ++at;
    const std::size_t end = text.find(']', at);
    return end == std::string_view::npos ? text.size() : end + 1;
}

/// `text` begins with '%'.
Conversion conversion_at(std::string_view text, FormatKind kind) {
    std::size_t at = text.find_first_not_of("-+ #0'*.$123456789I", 1);
    if (at == std::string_view::npos) return {text.size(), 0};
    const std::size_t size_from = at;
    at = text.find_first_not_of("hlLqjzt", at);
    if (at == std::string_view::npos) return {text.size(), 0};
    if (kind == FormatKind::scan && text[at] == '[') return {behind_set(text, at + 1), 0};
    const bool whole = std::strchr("diouxXn", text[at]) != nullptr;
    const bool single = at == size_from + 1 && text[size_from] == 'l';
    return {at + 1, whole && single ? size_from : 0};
}

/// Calls `keep` with each stretch that stays. Returns the size of all of them.
template <typename Keep>
std::size_t stretches_of(std::string_view format, FormatKind kind, Keep keep) {
    std::size_t kept = 0;
    const auto keep_counted = [&](std::string_view part) {
        kept += part.size();
        keep(part);
    };
    while (!format.empty()) {
        const std::size_t percent = std::min(format.find('%'), format.size());
        keep_counted(format.substr(0, percent));
        format.remove_prefix(percent);
        if (format.empty()) break;
        const Conversion found = conversion_at(format, kind);
        const std::size_t cut = found.single_l ? found.single_l : found.length;
        keep_counted(format.substr(0, cut));
        if (found.single_l) keep_counted(format.substr(cut + 1, found.length - cut - 1));
        format.remove_prefix(found.length);
    }
    return kept;
}

}  // namespace

NarrowFormat::NarrowFormat(const char* format, FormatKind kind) : text_(format) {
    if (!format) return;
    const std::string_view whole = format;
    const std::size_t size = stretches_of(whole, kind, [](std::string_view) {});
    if (size == whole.size()) return;
    char* to = small_.data();
    if (size >= small_.size()) {
        large_.resize(size);
        to = large_.data();
    }
    text_ = to;
    stretches_of(whole, kind, [&to](std::string_view part) { to = std::copy(part.begin(), part.end(), to); });
}

}  // namespace qduino::arduino
