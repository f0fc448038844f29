#include "web/http/content_coding.h"

#include <optional>
#include <string>

#include "base/whole_number.h"
#include "web/http/http.h"

namespace qduino::web {

namespace {

/// "0", "0.5", "1.000" in thousandths; nothing for anything else.
std::optional<int> thousandths_of(std::string_view text) {
    std::string digits{take_until(text, '.')};  // `text` keeps the decimals
    if ((digits != "0" && digits != "1") || text.size() > 3) return std::nullopt;
    digits.append(text).resize(4, '0');
    const std::optional<int> value = whole_number<int>(digits);
    return value && *value <= 1000 ? value : std::nullopt;
}

/// The weight of one element's parameters; malformed ones make it 0.
int weight_of(std::string_view parameters) {
    int weight = 1000;
    while (!parameters.empty()) {
        const std::string_view parameter = trimmed(take_until(parameters, ';'));
        if (equal_ignoring_case(parameter.substr(0, 2), "q="))
            weight = thousandths_of(parameter.substr(2)).value_or(0);
    }
    return weight;
}

std::optional<Coding> coding_of(std::string_view name) {
    if (equal_ignoring_case(name, "br")) return Coding::brotli;
    if (equal_ignoring_case(name, "gzip") || equal_ignoring_case(name, "x-gzip")) return Coding::gzip;
    if (equal_ignoring_case(name, "identity")) return Coding::identity;
    return std::nullopt;
}

}  // namespace

std::string_view word_of(Coding coding) {
    constexpr std::array<std::string_view, kCodings> kWords{"identity", "gzip", "br"};
    return kWords[static_cast<std::size_t>(coding)];
}

Coding choose_coding(std::string_view accept_encoding, const std::array<bool, kCodings>& there) {
    std::array<std::optional<int>, kCodings> weights;
    std::optional<int> others;
    while (!accept_encoding.empty()) {
        std::string_view element = trimmed(take_until(accept_encoding, ','));
        const std::string_view name = trimmed(take_until(element, ';'));
        const int weight = weight_of(element);
        if (name == "*") others = weight;
        if (const std::optional<Coding> coding = coding_of(name))
            weights[static_cast<std::size_t>(*coding)] = weight;
    }
    // A coding that is not named weighs what `*` does. Identity is acceptable without being named,
    // but after any coding that is.
    Coding best = Coding::identity;
    int best_weight = weights[0].value_or(others.value_or(1));
    for (const Coding coding : {Coding::gzip, Coding::brotli}) {
        const std::size_t index = static_cast<std::size_t>(coding);
        const int weight = weights[index].value_or(others.value_or(0));
        if (!there[index] || weight == 0 || weight < best_weight) continue;
        best = coding;
        best_weight = weight;
    }
    return best;
}

bool names_etag(std::string_view if_none_match, std::string_view etag) {
    while (!if_none_match.empty()) {
        std::string_view tag = trimmed(take_until(if_none_match, ','));
        if (tag.starts_with("W/")) tag.remove_prefix(2);
        if (tag == etag || tag == "*") return true;
    }
    return false;
}

}  // namespace qduino::web
