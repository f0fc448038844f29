#include "apps/host/sketch_output.h"

#include <cstdio>

#include "apps/terminal/message.h"

// Weak, as in setup_need.cpp: null unless the sketch uses Serial.
namespace qduino::arduino {
[[gnu::weak]] void settle_console();
[[gnu::weak]] void hold_console(bool held);
}  // namespace qduino::arduino

namespace qduino::apps {

void settle_sketch_output() {
    if (&arduino::settle_console != nullptr) arduino::settle_console();
    std::fflush(stdout);
}

void hold_sketch_output(bool held) {
    if (&arduino::hold_console != nullptr) arduino::hold_console(held);
}

void report_beside_sketch(const std::string& text) { say("\n" + text); }

}  // namespace qduino::apps
