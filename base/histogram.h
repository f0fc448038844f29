// A histogram of durations with a bounded relative error: log-linear buckets, fixed memory,
// trivially copyable.
//
//   value:   0 1 2 … 15 | 16 17 … 31 | 32 34 … 62 | 64 68 … 124 | …    16 buckets in a power of two
//   width:        1            1            2             4
//
// The relative error of a quantile is below 1/16 = 6.25 %; min, max, sum and count are exact.
// Recording is one count-leading-zeros and one increment: it is meant for every step of a real-time
// loop. (The layout is that of G. Tene's HdrHistogram, with 4 sub-bucket bits.)
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <limits>

namespace qduino {

/// Non-negative 64-bit values, unit by the owner's name (e.g. lateness_ns). Negative values count
/// as 0.
class Histogram {
  public:
    static constexpr int kSubBits = 4;
    // Up to 2^40 (18 minutes in ns); larger values count as that.
    static constexpr int kBuckets = (40 - kSubBits + 1) << kSubBits;

    constexpr void record(std::int64_t value) {
        const std::uint64_t v = value < 0 ? 0 : static_cast<std::uint64_t>(value);
        ++counts_[index_of(v)];
        ++count_;
        sum_ += v;
        if (v < min_) min_ = v;
        if (v > max_) max_ = v;
    }
    constexpr void clear() { *this = Histogram{}; }

    [[nodiscard]] constexpr std::uint64_t count() const { return count_; }
    [[nodiscard]] constexpr std::uint64_t min() const { return count_ ? min_ : 0; }
    [[nodiscard]] constexpr std::uint64_t max() const { return max_; }
    [[nodiscard]] constexpr double mean() const {
        return count_ ? static_cast<double>(sum_) / static_cast<double>(count_) : 0.0;
    }
    /// The smallest bucket bound that at least `q` (0…1) of all values do not exceed; never above
    /// max().
    [[nodiscard]] constexpr std::uint64_t quantile(double q) const {
        if (count_ == 0) return 0;
        const double wanted = q * static_cast<double>(count_);
        std::uint64_t seen = 0;
        for (int i = 0; i < kBuckets; ++i) {
            seen += counts_[i];
            if (seen > 0 && static_cast<double>(seen) >= wanted) {
                // The last bucket also holds everything beyond its own bound.
                if (i == kBuckets - 1) return max_;
                const std::uint64_t bound = upper_bound_of(i);
                return bound > max_ ? max_ : bound;
            }
        }
        return max_;
    }
    [[nodiscard]] constexpr std::uint64_t bucket_count(int index) const { return counts_[index]; }
    /// Largest value that falls in bucket `index`.
    static constexpr std::uint64_t upper_bound_of(int index) {
        const int group = index >> kSubBits;
        const std::uint64_t sub = static_cast<std::uint64_t>(index & ((1 << kSubBits) - 1));
        if (group == 0) return sub;
        return (((std::uint64_t{1} << kSubBits) + sub + 1) << (group - 1)) - 1;
    }

  private:
    static constexpr int index_of(std::uint64_t v) {
        if (v < (1u << kSubBits)) return static_cast<int>(v);
        const int top = 63 - std::countl_zero(v);
        const int index = ((top - kSubBits + 1) << kSubBits) +
                          static_cast<int>((v >> (top - kSubBits)) & ((1u << kSubBits) - 1));
        return index < kBuckets ? index : kBuckets - 1;
    }

    std::array<std::uint64_t, kBuckets> counts_{};
    std::uint64_t count_ = 0;
    std::uint64_t sum_ = 0;
    std::uint64_t min_ = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t max_ = 0;
};

}  // namespace qduino
