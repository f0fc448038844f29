// The idle watch alone: the kinds of use, the time-out, and what unlatches it; then at random,
// against a slow oracle.
#include <gtest/gtest.h>

#include <random>

#include "printer/heat/idle_watch.h"

namespace qduino::printer::heat::idle_watch_test {
namespace {

constexpr Nanoseconds kSample = 8ms;

struct Bench {
    explicit Bench(double timeout_s = 600) : watch(timeout_s) {}
    HeatUse use;
    IdleWatch watch;
    Instant now{};

    bool run(double seconds) {
        bool off = false;
        for (int i = 0; i < static_cast<int>(seconds / 0.008); ++i) {
            now += kSample;
            off = watch.sample(now, use);
        }
        return off;
    }
    void hot(double celsius = 200) {
        use.heaters[0] = {celsius, celsius, false};
        ++use.requests;
    }
};

TEST(IdleWatch, TimesOutOnceAndStaysOff) {
    Bench bench;
    bench.hot();
    EXPECT_FALSE(bench.run(599));
    EXPECT_NEAR(to_seconds(bench.watch.left().value()), 1, 0.1);
    EXPECT_TRUE(bench.run(2));
    EXPECT_FALSE(bench.watch.left());
    ++bench.use.pulses;
    EXPECT_TRUE(bench.run(10)) << "pulses do not unlatch it";
    bench.use.heaters[0].target_celsius = 0;
    EXPECT_TRUE(bench.run(10)) << "nor does loop 1's taking the target back";
    bench.hot();
    EXPECT_FALSE(bench.run(10));
}

TEST(IdleWatch, WithoutATargetNothingIsCounted) {
    Bench bench;
    EXPECT_FALSE(bench.run(5000));
    EXPECT_FALSE(bench.watch.left());
    bench.hot();
    EXPECT_FALSE(bench.run(590)) << "counted from the target on";
}

TEST(IdleWatch, ZeroNeverTimesOut) {
    Bench bench(0);
    bench.hot();
    EXPECT_FALSE(bench.run(20'000));
    EXPECT_FALSE(bench.watch.left());
}

TEST(IdleWatch, PulsesAndRequestsAreUse) {
    Bench bench(60);
    bench.hot();
    for (int i = 0; i < 10; ++i) {
        EXPECT_FALSE(bench.run(50));
        if (i % 2 == 0) ++bench.use.pulses;
        if (i % 2 == 1) ++bench.use.requests;
    }
    EXPECT_TRUE(bench.run(61));
}

TEST(IdleWatch, InUseNothingIsCountedDown) {
    Bench bench;
    bench.hot();
    for (int i = 0; i < 20; ++i) {
        ++bench.use.pulses;
        bench.run(5);
        EXPECT_FALSE(bench.watch.left());
    }
    bench.run(20);
    EXPECT_TRUE(bench.watch.left());
}

TEST(IdleWatch, OnTheWayUpIsUse) {
    Bench bench(60);
    bench.use.heaters[1] = {20, 100, true};
    ++bench.use.requests;
    EXPECT_FALSE(bench.run(1000));
    bench.use.heaters[1] = {96, 100, false};
    EXPECT_TRUE(bench.run(61));
}

TEST(IdleWatch, OnTheWayDownIsUseOnlyWhileItGetsCooler) {
    Bench bench(60);
    bench.use.heaters[1] = {90, 40, false};
    ++bench.use.requests;
    for (double celsius = 90; celsius > 60; celsius -= 0.5) {
        bench.use.heaters[1].celsius = celsius;
        EXPECT_FALSE(bench.run(25)) << celsius;
    }
    EXPECT_TRUE(bench.run(90)) << "stuck above its target";
}

/// Every sample that ever was is looked at again: off if nothing in [now − timeout, now] was a use,
/// since the last request.
TEST(IdleWatch, AgreesWithALookAtTheWholePast) {
    for (unsigned seed = 1; seed <= 200; ++seed) {
        std::mt19937 random(seed);
        const int timeout = 5 + static_cast<int>(random() % 20);  // samples of one second
        IdleWatch watch(timeout);
        HeatUse use;
        std::vector<bool> used;
        bool latched = false;
        for (int second = 0; second < 300; ++second) {
            const bool asks = random() % 25 == 0;
            const bool moves = random() % 15 == 0;
            const bool heats = random() % 30 == 0;
            if (asks) {
                ++use.requests;
                const double target = random() % 4 == 0 ? 0 : 200;
                use.heaters[0] = {200, target, false};
            }
            if (moves) ++use.pulses;
            use.heaters[0].heating_up = heats;
            const bool on = use.heaters[0].target_celsius > 0;
            used.push_back(second == 0 || !on || asks || moves || (heats && on));
            if (asks) latched = false;
            bool recently = used.size() <= static_cast<std::size_t>(timeout);
            for (std::size_t back = 0; back < static_cast<std::size_t>(timeout) && back < used.size(); ++back)
                recently = recently || used[used.size() - 1 - back];
            latched = latched || !recently;
            ASSERT_EQ(watch.sample(kEpoch + std::chrono::seconds{second}, use), latched)
                << "seed " << seed << " second " << second;
        }
    }
}

}  // namespace
}  // namespace qduino::printer::heat::idle_watch_test
