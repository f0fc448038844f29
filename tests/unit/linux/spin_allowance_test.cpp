#include "board/linux/loop/spin_allowance.h"

#include <gtest/gtest.h>

#include <random>

namespace qduino::board::linux::spin_allowance_test {
namespace {

/// A thread that only waits for instants `apart` one after the other, for `length`; what it slept,
/// and by how much it passed one at worst.
struct Spun {
    Nanoseconds asleep{0};
    Nanoseconds longest_second{0};  ///< most that it ran in any second from a multiple of 100 ms on
    Nanoseconds late_max{0};
};

Spun spin(SpinAllowance allowance, Nanoseconds apart, Nanoseconds length, Nanoseconds wake_up) {
    Spun spun;
    Instant now = kEpoch;
    std::vector<Nanoseconds> ran_by(static_cast<std::size_t>(length / 100ms) + 2);
    Nanoseconds ran{0};
    for (Instant due = kEpoch + apart; due < kEpoch + length; due += apart) {
        const Instant before = now;
        if (const Instant until = allowance.sleep_first(now, due); until > now) {
            now = until + wake_up;
            spun.asleep += now - before;
            allowance.slept(now);
        }
        if (now > due) spun.late_max = std::max(spun.late_max, now - due);
        if (due > now) ran += due - now;
        now = std::max(now, due);
        ran_by[static_cast<std::size_t>((now - kEpoch) / 100ms)] = ran;
    }
    for (std::size_t i = 10; i < ran_by.size(); ++i) {
        if (ran_by[i] > Nanoseconds{0})
            spun.longest_second = std::max(spun.longest_second, ran_by[i] - ran_by[i - 10]);
    }
    return spun;
}

TEST(SpinAllowance, ACoreOfItsOwnIsNeverLeft) {
    EXPECT_EQ(spin(SpinAllowance{}, 100us, 5s, 30us).asleep, 0ns);
}

TEST(SpinAllowance, NoSecondIsFilledBeyondWhatTheKernelGrants) {
    for (const Nanoseconds apart :
         {Nanoseconds{20us}, Nanoseconds{100us}, Nanoseconds{250us}, Nanoseconds{5ms}}) {
        const Spun spun = spin(SpinAllowance{0.92, kEpoch}, apart, 5s, 40us);
        EXPECT_LT(spun.longest_second, 950ms) << to_ns(apart);
        EXPECT_GT(spun.longest_second, 0ns);
    }
}

TEST(SpinAllowance, LongWaitsAreSleptThroughWithoutBeingLate) {
    const Spun spun = spin(SpinAllowance{0.92, kEpoch}, 1ms, 5s, 100us);
    EXPECT_GT(spun.asleep, 300ms);
    EXPECT_EQ(spun.late_max, 0ns);
}

TEST(SpinAllowance, ShortWaitsArePassedByAPauseAtMost) {
    const Spun spun = spin(SpinAllowance{0.92, kEpoch}, 100us, 5s, 40us);
    EXPECT_GT(spun.asleep, 350ms);
    EXPECT_LE(spun.late_max, SpinAllowance::kForced + 40us);
}

TEST(SpinAllowance, AfterARestItMayRunForAWhile) {
    SpinAllowance allowance{0.92, kEpoch};
    Instant now = kEpoch;
    while (allowance.sleep_first(now, now + 100us) == now) now += 100us;
    EXPECT_GT(now, kEpoch + 200ms);  // 20 ms at a loss of 8 % last 250 ms
    allowance.slept(now + 1s);
    EXPECT_EQ(allowance.sleep_first(now + 1s, now + 1s + 100us), now + 1s);
}

}  // namespace
}  // namespace qduino::board::linux::spin_allowance_test
