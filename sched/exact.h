// Exact integer arithmetic for decisions: products of 64 bits in 128, quotients rounded up or down
// as the caller asks.
#pragma once

#include <cstdint>

#include "base/time.h"

namespace qduino::sched {

__extension__ using Int128 = __int128;

/// ⌊a·b/c⌋. Contract: a, b >= 0, c > 0, and the result fits.
constexpr std::int64_t mul_div_floor(std::int64_t a, std::int64_t b, std::int64_t c) {
    return static_cast<std::int64_t>(Int128{a} * b / c);
}

/// ⌈a·b/c⌉. Contract: as above.
constexpr std::int64_t mul_div_ceil(std::int64_t a, std::int64_t b, std::int64_t c) {
    std::int64_t product = 0;
    // Most products fit, and a quotient of 64 bits takes a fraction of the time.
    if (!__builtin_mul_overflow(a, b, &product) && product <= INT64_MAX - c) return (product + (c - 1)) / c;
    return static_cast<std::int64_t>((Int128{a} * b + (c - 1)) / c);
}

/// ⌈a/b⌉. Contract: a >= 0, b > 0.
constexpr std::int64_t div_ceil(std::int64_t a, std::int64_t b) { return a / b + (a % b != 0 ? 1 : 0); }

/// A period that much is divided by: a multiplication gives the quotient but for the last unit, and
/// whole numbers decide that one.
class Divisor {
  public:
    constexpr Divisor() = default;
    /// Contract: period > 0.
    constexpr explicit Divisor(Nanoseconds period)
        : period_(period.count()), inverse_(1.0 / static_cast<double>(period.count())) {}

    [[nodiscard]] constexpr Nanoseconds period() const { return Nanoseconds{period_}; }
    /// ⌈time/period⌉. Contract: time >= 0.
    [[nodiscard]] constexpr std::int64_t ceil(Nanoseconds time) const {
        const std::int64_t a = time.count();
        auto quotient = static_cast<std::int64_t>(static_cast<double>(a) * inverse_);
        while (quotient * period_ < a) ++quotient;
        while ((quotient - 1) * period_ >= a) --quotient;
        return quotient;
    }

  private:
    std::int64_t period_ = 1;
    double inverse_ = 1;
};

/// A share budget/period that much is multiplied with: as above, one multiplication gives the
/// product but for the last unit.
class Rate {
  public:
    constexpr Rate() = default;
    /// Contract: budget >= 0, period > 0.
    constexpr Rate(Nanoseconds budget, Nanoseconds period)
        : budget_(budget.count()),
          period_(period.count()),
          ratio_(static_cast<double>(budget.count()) / static_cast<double>(period.count())) {}

    /// ⌈time·budget/period⌉. Contract: time >= 0, and the result is below 2^52.
    [[nodiscard]] constexpr Nanoseconds ceil(Nanoseconds time) const {
        const Int128 asked = Int128{time.count()} * budget_;
        auto product = static_cast<std::int64_t>(static_cast<double>(time.count()) * ratio_);
        while (Int128{product} * period_ < asked) ++product;
        while (Int128{product - 1} * period_ >= asked) --product;
        return Nanoseconds{product};
    }

  private:
    std::int64_t budget_ = 0;
    std::int64_t period_ = 1;
    double ratio_ = 0;
};

}  // namespace qduino::sched
