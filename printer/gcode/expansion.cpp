#include "printer/gcode/expansion.h"

#include <algorithm>

#include "base/contract.h"
#include "printer/gcode/text.h"
#include "printer/gcode/word_parameters.h"

namespace qduino::printer::gcode {
namespace {

/// The value of `{parameter}`.
Result<std::string_view> value_of(std::string_view parameter, std::string_view name,
                                  std::string_view arguments) {
    const std::size_t equals = std::min(parameter.find('='), parameter.size());
    FixedString<32> key;
    for (const char c : trim(parameter.substr(0, equals))) key.push_back(to_upper(c));
    if (const auto given = word_value(arguments, key.view())) return *given;
    if (equals < parameter.size()) return trim(parameter.substr(equals + 1));
    return make_error(ErrorCode::invalid_argument, name, " needs ", key, "=…");
}

}  // namespace

const Macro* find_macro(const MachineConfig& config, std::string_view word) {
    const auto* const found =
        std::ranges::find_if(config.macros, [&](const Macro& macro) { return macro.name.view() == word; });
    return found != config.macros.end() ? found : nullptr;
}

Result<void> Expansion::append(std::string_view piece) {
    if (lines_.size() + piece.size() > kBytesMax)
        return make_error(ErrorCode::out_of_range, name_, " becomes longer than ", kBytesMax, " bytes");
    lines_.append(piece);
    return {};
}

Result<void> Expansion::begin(std::string_view name, std::string_view text, std::string_view arguments) {
    clear();
    name_.assign(name);
    const auto fill = [&]() -> Result<void> {
        while (!text.empty()) {
            const std::size_t open = std::min(text.find('{'), text.size());
            QDUINO_TRY(append(text.substr(0, open)));
            text.remove_prefix(open);
            if (text.empty()) break;
            const std::size_t close = text.find('}');
            if (close == std::string_view::npos)
                return make_error(ErrorCode::invalid_argument, name, ": a { without its }");
            QDUINO_TRY_ASSIGN(const auto value, value_of(text.substr(1, close - 1), name, arguments));
            QDUINO_TRY(append(value));
            text.remove_prefix(close + 1);
        }
        return {};
    };
    const Result<void> filled = fill();
    if (!filled) clear();
    return filled;
}

std::string_view Expansion::next() {
    QDUINO_EXPECT(active());
    const std::string_view rest = lines_.view().substr(at_);
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    at_ = std::min(at_ + end + 1, lines_.size());
    return rest.substr(0, end);
}

}  // namespace qduino::printer::gcode
