#include "printer/gcode/host_session.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "printer/gcode/text.h"

namespace qduino::printer::gcode {
namespace {

/// No host counts further.
constexpr double kHostNumberMax = 1e15;

/// The line ends as one with a check sum does: `… *57`.
bool ends_in_checksum(std::string_view line) {
    const std::size_t star = line.rfind('*');
    if (star == std::string_view::npos) return false;
    const std::string_view digits = trim(line.substr(star + 1));
    return !digits.empty() && std::ranges::all_of(digits, is_digit);
}

}  // namespace

HostVerdict HostSession::accept(const Line& line) {
    const auto number = line.frame.number;
    if (!number)
        return ends_in_checksum(line.text) ? ask_again("No Line Number with checksum") : HostVerdict{};
    if (line.frame.checksum == Checksum::absent) return ask_again("No Checksum with line number");
    if (line.frame.checksum == Checksum::wrong) return ask_again("checksum mismatch");
    // M110 says which number comes next whatever was before: by its own N, or by its parameter.
    const Command* command = line.command;
    if (command != nullptr && command->letter == 'M' && command->number == 110) {
        const auto given = command->parameters.value('N');
        const bool usable = given && std::abs(*given) <= kHostNumberMax;
        last_line_ = usable ? static_cast<std::int64_t>(*given) : *number;
        return {};
    }
    if (*number != last_line_ + 1) return ask_again("Line Number is not Last Line Number+1");
    last_line_ = *number;
    return {};
}

HostVerdict HostSession::ask_again(const char* what) const {
    return {false, text<FixedString<160>>("Error:", what, ", Last Line: ", last_line_,
                                          "\nResend: ", last_line_ + 1, "\nok")};
}

}  // namespace qduino::printer::gcode
