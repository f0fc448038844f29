// Exact integer arithmetic for decisions: products of 64 bits in 128, quotients rounded up or down
// as the caller asks.
#pragma once

#include <cstdint>

namespace qduino::sched {

__extension__ using Int128 = __int128;

/// ⌊a·b/c⌋. Contract: a, b >= 0, c > 0, and the result fits.
constexpr std::int64_t mul_div_floor(std::int64_t a, std::int64_t b, std::int64_t c) {
    return static_cast<std::int64_t>(Int128{a} * b / c);
}

/// ⌈a·b/c⌉. Contract: as above.
constexpr std::int64_t mul_div_ceil(std::int64_t a, std::int64_t b, std::int64_t c) {
    return static_cast<std::int64_t>((Int128{a} * b + (c - 1)) / c);
}

/// ⌈a/b⌉. Contract: a >= 0, b > 0.
constexpr std::int64_t div_ceil(std::int64_t a, std::int64_t b) { return a / b + (a % b != 0 ? 1 : 0); }

}  // namespace qduino::sched
