#include "base/histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <type_traits>
#include <vector>

namespace qduino::histogram_test {
namespace {

static_assert(std::is_trivially_copyable_v<Histogram>);

/// The q-quantile of sorted values: the smallest that at least q of all do not exceed.
std::uint64_t exact_quantile(const std::vector<std::uint64_t>& sorted, double q) {
    const double wanted = std::ceil(q * static_cast<double>(sorted.size()));
    const std::size_t rank = static_cast<std::size_t>(std::max(wanted, 1.0));
    return sorted[rank - 1];
}

TEST(Histogram, EmptyIsZero) {
    const Histogram histogram;
    EXPECT_EQ(histogram.count(), 0u);
    EXPECT_EQ(histogram.min(), 0u);
    EXPECT_EQ(histogram.max(), 0u);
    EXPECT_EQ(histogram.quantile(0.5), 0u);
    EXPECT_EQ(histogram.mean(), 0.0);
}

TEST(Histogram, SmallValuesAreExact) {
    Histogram histogram;
    for (int v = 0; v < 32; ++v) histogram.record(v);
    for (int v = 0; v < 32; ++v) EXPECT_EQ(histogram.quantile((v + 1) / 32.0), static_cast<std::uint64_t>(v));
}

TEST(Histogram, NegativeCountsAsZero) {
    Histogram histogram;
    histogram.record(-5);
    EXPECT_EQ(histogram.max(), 0u);
    EXPECT_EQ(histogram.count(), 1u);
}

TEST(Histogram, EveryBucketBoundIsTheLastOfItsBucket) {
    for (int i = 0; i + 1 < Histogram::kBuckets; ++i) {
        const std::uint64_t bound = Histogram::upper_bound_of(i);
        Histogram histogram;
        histogram.record(static_cast<std::int64_t>(bound));
        histogram.record(static_cast<std::int64_t>(bound + 1));
        ASSERT_EQ(histogram.bucket_count(i), 1u) << "bucket " << i;
        ASSERT_EQ(histogram.bucket_count(i + 1), 1u) << "bucket " << i;
    }
}

TEST(Histogram, QuantilesAreWithinASixteenthAboveTheSortedOnes) {
    std::mt19937_64 random{3};
    for (int round = 0; round < 60; ++round) {
        Histogram histogram;
        std::vector<std::uint64_t> values;
        std::lognormal_distribution<double> spread{10.0, 3.0};
        for (int i = 0; i < 2000; ++i) {
            values.push_back(static_cast<std::uint64_t>(std::min(spread(random), 1e12)));
            histogram.record(static_cast<std::int64_t>(values.back()));
        }
        std::sort(values.begin(), values.end());
        EXPECT_EQ(histogram.min(), values.front());
        EXPECT_EQ(histogram.max(), values.back());
        for (const double q : {0.0, 0.01, 0.5, 0.9, 0.99, 0.999, 0.9999, 1.0}) {
            const std::uint64_t exact = exact_quantile(values, q);
            ASSERT_GE(histogram.quantile(q), exact) << "q " << q;
            ASSERT_LE(histogram.quantile(q), exact + exact / 16) << "q " << q;
        }
    }
}

/// Beyond the last bucket nothing is under-reported: the worst case is the one that matters.
TEST(Histogram, ValuesBeyondTheLastBucketAreNotUnderReported) {
    Histogram histogram;
    histogram.record(std::int64_t{1} << 50);
    histogram.record(std::int64_t{1} << 51);
    EXPECT_GE(histogram.quantile(0.5), std::uint64_t{1} << 50);
    EXPECT_EQ(histogram.quantile(1.0), std::uint64_t{1} << 51);
    EXPECT_EQ(histogram.max(), std::uint64_t{1} << 51);
}

TEST(Histogram, ClearedItHoldsNothing) {
    Histogram histogram;
    histogram.record(7);
    histogram.clear();
    EXPECT_EQ(histogram.count(), 0u);
    EXPECT_EQ(histogram.max(), 0u);
    EXPECT_EQ(histogram.quantile(1.0), 0u);
}

}  // namespace
}  // namespace qduino::histogram_test
