#include "spin_code.h"

namespace qduino::board::sim::testing {

void jump_to_itself() {
    while (true) {
    }
}

void spin_until(const volatile bool& flag) {
    while (!flag) {
    }
}

void spin_on(const bool& flag) {
    while (!flag) {
    }
}

std::uint64_t count_until(const volatile bool& flag) {
    std::uint64_t count = 0;
    while (!flag) count += 1;
    return count;
}

void ask_until(bool (*ask)(void*), void* context) {
    while (!ask(context)) {
    }
}

std::uint32_t compute(std::uint32_t blocks) {
    std::uint32_t state = 1;
    for (std::uint32_t i = 0; i < blocks; ++i) state = state * 1664525u + (state >> 7);
    return state;
}

}  // namespace qduino::board::sim::testing
