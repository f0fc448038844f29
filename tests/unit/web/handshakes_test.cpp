// The turns of TLS handshakes: bounded in rate and number, fair between addresses.
#include "web/net/handshakes.h"

#include <gtest/gtest.h>

namespace qduino::web::handshakes_test {
namespace {

constexpr Instant kStart = instant_from_ns(1'000'000'000'000);

TEST(Handshakes, AreBoundedInRate) {
    Handshakes handshakes;
    for (Handshakes::Id id = 1; id <= 500; ++id) handshakes.wait(id, "a");
    int turns = 0;
    while (handshakes.next(kStart)) ++turns;
    EXPECT_EQ(turns, Handshakes::kBurst);
    for (int ms = 1; ms <= 1000; ++ms)
        while (handshakes.next(kStart + std::chrono::milliseconds{ms})) ++turns;
    EXPECT_EQ(turns, Handshakes::kBurst + 100);
    EXPECT_TRUE(handshakes.is_waited_for());
}

TEST(Handshakes, ANewAddressWaitsForOneTurnOfTheOthersAndNotForAll) {
    Handshakes handshakes;
    for (Handshakes::Id id = 1; id <= 500; ++id) handshakes.wait(id, id % 2 == 0 ? "a" : "c");
    for (int i = 0; i < Handshakes::kBurst; ++i) ASSERT_TRUE(handshakes.next(kStart));
    for (const char* owner : {"0", "b", "z"}) {
        static Handshakes::Id id = 1000;
        handshakes.wait(++id, owner);
        bool came = false;
        for (int turn = 1; turn <= 3 && !came; ++turn) {
            static Instant now = kStart + std::chrono::seconds{1};
            now += Handshakes::kEvery * Handshakes::kBurst;
            const auto next = handshakes.next(now);
            ASSERT_TRUE(next);
            came = next->id == id;
        }
        EXPECT_TRUE(came) << owner;
    }
}

TEST(Handshakes, OneAddressCannotTakeThePlacesOfAnother) {
    Handshakes handshakes;
    Instant now = kStart;
    handshakes.wait(1, "owner");
    ASSERT_FALSE(handshakes.next(now)->leaver);
    int left = 0;
    for (Handshakes::Id id = 2; id <= 1000; ++id) {
        handshakes.wait(id, "flood");
        now += Handshakes::kEvery;
        const auto turn = handshakes.next(now);
        ASSERT_TRUE(turn);
        if (turn->leaver) {
            EXPECT_NE(*turn->leaver, 1u);
            ++left;
        }
    }
    EXPECT_EQ(left, 999 - 48);
}

TEST(Handshakes, WhoLeavesIsForgottenWhereverHeStands) {
    Handshakes handshakes;
    handshakes.wait(1, "a");
    handshakes.wait(2, "a");
    handshakes.leave(1);
    EXPECT_EQ(handshakes.next(kStart)->id, 2u);
    handshakes.leave(2);
    handshakes.leave(3);
    EXPECT_FALSE(handshakes.is_waited_for());
    EXPECT_FALSE(handshakes.next(kStart));
}

}  // namespace
}  // namespace qduino::web::handshakes_test
