// From the first instruction in C++ to the program around the sketch:
//
//   boot facts ─► heap ─► static objects ─► guard pages ─► ACPI ─► clock ─► core 0
//              ─► I/O APIC, serial lines ─► the host's stack ─► the other cores, one by one
//              ─► metal_main()
#pragma once

#include <string_view>

namespace qduino::board::metal {

/// The program: what an app defines. It runs as the host, on core 0, with interrupts on, and ends
/// with turn_off(). `words`: the command line that the loader was given.
[[noreturn]] void metal_main(std::string_view words);

}  // namespace qduino::board::metal
