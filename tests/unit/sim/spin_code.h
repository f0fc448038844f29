// Code as a sketch's: compiled with -fsanitize-coverage=trace-pc, as `qduino sim` compiles.
#pragma once

#include <cstdint>

namespace qduino::board::sim::testing {

/// `while (true);`
[[noreturn]] void jump_to_itself();
/// `while (!flag);` of a flag that others may set, and of one of which the compiler knows better.
void spin_until(const volatile bool& flag);
void spin_on(const bool& flag);
/// Counts on while it spins.
std::uint64_t count_until(const volatile bool& flag);
/// `while (!server.available());`: calls `ask`, code of the board's, until it says yes.
void ask_until(bool (*ask)(void*), void* context);
/// At least `blocks` basic blocks, and an end.
std::uint32_t compute(std::uint32_t blocks);

}  // namespace qduino::board::sim::testing
