// The twin's own reader of G-code: bytes → lines → words, names and flavours, and what they ask
// for. Every number is finite, and every name is a part of its line.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "../gcode/fuzz_check.h"
#include "tests/unit/twin/text_source.h"
#include "twin/asked_path.h"
#include "twin/line_reader.h"

namespace {

using namespace qduino::twin;

void check(const CommandLine& command) {
    for (char letter = 'A'; letter <= 'Z'; ++letter)
        if (command.has_number(letter)) FUZZ_EXPECT(std::isfinite(command.value(letter)));
    const auto name = command.word_name("NAME", {"CURRENT", "RESET", "CENTER"});
    if (name) FUZZ_EXPECT(command.tail.find(*name) != std::string::npos);
    static_cast<void>(command.word_number("NAME"));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string text{reinterpret_cast<const char*>(data), size};
    TextSource lines{text};
    LineReader reader{lines};
    while (const auto command = reader.next()) check(*command);
    TextSource source{text};
    AskedPath path{source, {}, Machine{}};
    for (int items = 0; items < 100'000 && path.next().kind != AskedItem::Kind::end; ++items) {
    }
    return 0;
}
