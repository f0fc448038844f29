// What a bottom half takes from others while its budget is kept from outside, in every window of
// random runs: it is greedy or lazy as it likes, looks come late, and the kernel tells its time
// late. And wrong watches, which must be caught.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "sched/io_watch.h"
#include "tests/property/sched/windows.h"

namespace qduino::sched::io_watch_property_test {
namespace {

constexpr std::int64_t kLookEvery = 40, kLateMost = 20, kStaleMost = 40;  // ticks of 1 ns

struct Shape {
    std::int64_t budget, period, client;

    static Shape random(std::mt19937_64& source) {
        const auto pick = [&](std::int64_t low, std::int64_t high) {
            return std::uniform_int_distribution<std::int64_t>{low, high}(source);
        };
        const std::int64_t period = pick(20, 1000);
        return {pick(1, period / 2), period, pick(20, 1000)};
    }
};

class RealWatch {
  public:
    explicit RealWatch(const Shape& shape)
        : watch_({Nanoseconds{shape.budget}, Nanoseconds{shape.period}}, Nanoseconds{shape.client},
                 Nanoseconds{kLookEvery}, kEpoch, Nanoseconds{0}) {}
    bool look(std::int64_t now, std::int64_t cpu) {
        return watch_.look(instant_from_ns(now), Nanoseconds{cpu}) == IoWatch::Verdict::hold;
    }
    void held(std::int64_t now, std::int64_t cpu) { watch_.held(instant_from_ns(now), Nanoseconds{cpu}); }
    std::int64_t next_look() const { return to_ns(watch_.next_look()); }

  private:
    IoWatch watch_;
};

/// As above, but what it used on the way to being held is forgotten.
class ForgetsTheWay : public RealWatch {
  public:
    using RealWatch::RealWatch;
    void held(std::int64_t, std::int64_t) {}
};

/// As above, but it is let go at the next look.
class LetsGoAtOnce : public RealWatch {
  public:
    using RealWatch::RealWatch;
    bool look(std::int64_t now, std::int64_t cpu) {
        held_ = !held_ && RealWatch::look(now, cpu);
        return held_;
    }
    std::int64_t next_look() const { return std::min(RealWatch::next_look(), last_ += kLookEvery); }

  private:
    bool held_ = false;
    mutable std::int64_t last_ = 0;
};

/// Each tick in which it ran with its priority.
template <typename Watch>
Ran run(const Shape& shape, std::uint64_t seed, std::int64_t ticks) {
    std::mt19937_64 random{seed};
    const auto pick = [&](std::int64_t low, std::int64_t high) {
        return std::uniform_int_distribution<std::int64_t>{low, high}(random);
    };
    Watch watch{shape};
    Ran ran(static_cast<std::size_t>(ticks), 0);
    bool held = false, works = true;
    std::int64_t cpu = 0, told = 0, look_at = watch.next_look();
    for (std::int64_t now = 0; now < ticks; ++now) {
        if (now >= look_at) {
            told = held ? cpu : std::max(told, cpu - pick(0, kStaleMost));
            const bool hold = watch.look(now, told);
            if (hold && !held) watch.held(now, told = cpu);  // all is known when its rank is taken
            held = hold;
            look_at = std::max(watch.next_look(), now + 1) + pick(0, kLateMost);
        }
        if (pick(0, 2 * shape.client) == 0) works = !works;
        if (!works) continue;
        ++cpu;  // held, it has a core that nobody wants
        ran[static_cast<std::size_t>(now)] = !held;
    }
    return ran;
}

/// U·t + 2·(U·T + L): empty when it holds.
template <typename Watch>
std::string violation(std::uint64_t seed) {
    std::mt19937_64 random{seed};
    const Shape shape = Shape::random(random);
    const Ran ran = run<Watch>(shape, seed, 100'000);
    const std::int64_t longest_look = kLookEvery + kLateMost + kStaleMost;
    const std::int64_t service = shape.budget * shape.client / shape.period + 1;
    for (std::int64_t length = 1; length < 50'000; length += 1 + length / 3) {
        const std::int64_t most = most_in_window(ran, length);
        if (most > shape.budget * length / shape.period + 2 * (service + longest_look))
            return std::to_string(most) + " in a window of " + std::to_string(length);
    }
    return {};
}

TEST(IoWatchProperty, EveryWindowIsBounded) {
    for (std::uint64_t seed = 1; seed <= 100; ++seed)
        ASSERT_EQ(violation<RealWatch>(seed), "") << "seed " << seed;
}

template <typename Watch>
int caught() {
    int count = 0;
    for (std::uint64_t seed = 1; seed <= 100; ++seed) count += violation<Watch>(seed).empty() ? 0 : 1;
    return count;
}

TEST(IoWatchProperty, CatchesAWatchThatForgetsTheWay) { EXPECT_GT(caught<ForgetsTheWay>(), 10); }
TEST(IoWatchProperty, CatchesAWatchThatLetsGoAtOnce) { EXPECT_GT(caught<LetsGoAtOnce>(), 50); }

}  // namespace
}  // namespace qduino::sched::io_watch_property_test
