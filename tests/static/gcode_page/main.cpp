// Prints docs/gcode.md from the printer's own table of G-codes.
//
//   gcode-page > docs/gcode.md        after a change of printer/gcode/command_table.cpp
//   gcode-page --check docs/gcode.md  names the first line that differs, and ends with 1 (./test)
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <string_view>

#include "printer/gcode/command_table.h"

namespace {

using namespace qduino::printer::gcode;

constexpr std::string_view kHead = R"(# G-codes

Printed from `printer/gcode/command_table.cpp` by `gcode-page`; `./test` compares. How to add one: [adding.md](adding.md).

The dialect is Marlin's as slicers and hosts emit it. Letters that are not listed are ignored, or, where the row says *only*,
refused. A code that is not on this page is answered as unknown and skipped; it never ends a job.

*When it may be typed* (or sent by a host beside the job): **at rest** while no job runs; **paused** also while a job is paused and
the head waits beside the part; **printing** also while a job runs; **always** also while a fault is latched.

## Carried out

| code | what it does | letters | may be typed |
|---|---|---|---|
)";

constexpr std::string_view kSkipped = R"(
## Known, and skipped

The answer names them; a job goes on behind them.

| code | what it would do |
|---|---|
)";

std::string name_of(const Code& code) {
    if (code.letter == '\0') return std::string{code.word};
    std::string name = code.letter + std::to_string(code.number);
    if (code.letter == 'T') return name + " …";
    if (code.subcode == Code::kAnySubcode) return name + ".*";
    return code.subcode == Code::kNoSubcode ? name : name + "." + std::to_string(code.subcode);
}

std::string letters_of(const CodeInfo& info) {
    if (info.tail == Tail::free_text) return "a text";
    std::string letters;
    for (const char letter : info.parameters)
        letters += (letters.empty() ? "" : " ") + std::string(1, letter);
    if (info.strictness == Strictness::lenient) return letters;
    return letters.empty() ? "none" : letters + " only";
}

std::string_view word_of(Typed typed) {
    switch (typed) {
        case Typed::at_rest:
            return "at rest";
        case Typed::parked:
            return "paused";
        case Typed::printing:
            return "printing";
        case Typed::always:
            return "always";
    }
    return {};
}

std::string page() {
    std::ostringstream out;
    out << kHead;
    for (const CodeInfo& info : known_codes()) {
        if (info.handler == nullptr) continue;
        out << "| " << name_of(info.code) << " | " << info.name << " | " << letters_of(info) << " | "
            << word_of(info.typed) << " |\n";
    }
    out << kSkipped;
    for (const CodeInfo& info : known_codes()) {
        if (info.handler == nullptr) out << "| " << name_of(info.code) << " | " << info.name << " |\n";
    }
    return out.str();
}

/// 0 when `path` holds the page.
int check(const char* path) {
    std::ifstream file{path};
    std::istringstream wanted{page()};
    for (int number = 1;; ++number) {
        std::string is;
        std::string should_be;
        const bool more = static_cast<bool>(std::getline(file, is));
        const bool more_wanted = static_cast<bool>(std::getline(wanted, should_be));
        if (!more && !more_wanted) return 0;
        if (more == more_wanted && is == should_be) continue;
        std::cerr << path << ":" << number << ": is        " << is << "\n"
                  << path << ":" << number << ": should be " << should_be << "\n"
                  << "print it anew: build/release/bin/gcode-page > docs/gcode.md\n";
        return 1;
    }
}

}  // namespace

int main(int count, char** arguments) {
    if (count == 3 && std::string_view{arguments[1]} == "--check") return check(arguments[2]);
    if (count != 1) {
        std::cerr << "usage: gcode-page [--check FILE]\n";
        return 2;
    }
    std::cout << page();
    return 0;
}
