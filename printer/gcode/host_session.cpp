#include "printer/gcode/host_session.h"

#include "base/text.h"

namespace qduino::printer::gcode {

HostVerdict HostSession::accept(const Line& line) {
    const auto number = line.frame.number;
    if (!number) return {};
    if (line.frame.checksum == Checksum::absent) return refuse("No Checksum with line number");
    if (line.frame.checksum == Checksum::wrong) return refuse("checksum mismatch");
    // M110 says which number comes next whatever was before: by its own N, or by its parameter.
    const Command* command = line.command;
    if (command != nullptr && command->letter == 'M' && command->number == 110) {
        const auto given = command->parameters.value('N');
        const bool usable = given && *given >= 0 && *given <= 1e15;
        last_line_ = usable ? static_cast<std::uint64_t>(*given) : *number;
        return {};
    }
    if (*number != last_line_ + 1) return refuse("Line Number is not Last Line Number+1");
    last_line_ = *number;
    return {};
}

HostVerdict HostSession::refuse(const char* what) const {
    return {false, text<FixedString<160>>("Error:", what, ", Last Line: ", last_line_,
                                          "\nResend: ", last_line_ + 1, "\nok")};
}

}  // namespace qduino::printer::gcode
