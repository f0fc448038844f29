#include "printer/gcode/command.h"

#include "printer/gcode/text.h"

namespace qduino::printer::gcode {

FixedString<32> Command::name() const {
    if (letter == '\0') return word;
    FixedString<32> out;
    out.push_back(letter);
    append_integer(out, number);
    if (subcode) append_integer(out.push_back('.'), *subcode);
    return out;
}

}  // namespace qduino::printer::gcode
