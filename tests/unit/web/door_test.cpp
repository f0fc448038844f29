// Which connection leaves a full service. Random visits against a naive oracle: a list, searched
// from end to end.
#include "web/http/door.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace qduino::web::door_test {
namespace {

constexpr Instant at(int second) { return instant_from_ns(1'000'000'000ll * (1000 + second)); }
constexpr DoorLimits kSmall{6, 4, 3, 1000};

TEST(Door, ANewcomerAlwaysGetsAPlace) {
    Door door{kSmall};
    for (Door::Id id = 1; id <= 4; ++id)
        EXPECT_EQ(door.enter(id, "a", at(static_cast<int>(id))), std::nullopt);
    EXPECT_EQ(door.enter(5, "a", at(5)), 1u) << "the oldest of an address that has its share";
    EXPECT_EQ(door.enter(6, "b", at(6)), std::nullopt);
    EXPECT_EQ(door.enter(7, "b", at(7)), std::nullopt);
    EXPECT_EQ(door.enter(8, "c", at(8)), 2u) << "the oldest of the address that holds the most";
    EXPECT_EQ(door.strangers(), 6u);
}

TEST(Door, AStrangerNeverTakesThePlaceOfOneWhoHasShownTheKey) {
    Door door{kSmall};
    static_cast<void>(door.enter(1, "a", at(0)));
    EXPECT_EQ(door.set_known(1, true), std::nullopt);
    for (Door::Id id = 2; id < 1000; ++id) EXPECT_NE(door.enter(id, "a", at(static_cast<int>(id))), 1u);
    EXPECT_EQ(door.known(), 1u);
    EXPECT_EQ(door.strangers(), 4u);
}

TEST(Door, WhoFinishesSomethingIsYoungAgain) {
    Door door{kSmall};
    for (Door::Id id = 1; id <= 4; ++id) static_cast<void>(door.enter(id, "a", at(static_cast<int>(id))));
    door.set_busy(1, true, at(10));
    door.set_busy(2, true, at(10));
    door.set_busy(1, false, at(11));
    EXPECT_EQ(door.enter(5, "a", at(12)), 2u) << "a head that was only begun makes nobody young";
}

TEST(Door, OfTheKnownTheLongestIdleGoesAndNobodyWhoIsServed) {
    Door door{kSmall};
    for (Door::Id id = 1; id <= 3; ++id) {
        static_cast<void>(door.enter(id, "a", at(static_cast<int>(id))));
        EXPECT_EQ(door.set_known(id, true), std::nullopt);
    }
    door.set_busy(1, true, at(4));
    static_cast<void>(door.enter(4, "a", at(5)));
    EXPECT_EQ(door.set_known(4, true), 2u);
    EXPECT_EQ(door.known(), 3u);
    EXPECT_EQ(door.set_known(4, false), std::nullopt);
    EXPECT_EQ(door.strangers(), 1u);
}

TEST(Door, WhatWaitsToBeSentIsBoundedInAll) {
    Door door{kSmall};
    for (Door::Id id = 1; id <= 3; ++id) static_cast<void>(door.enter(id, "a", at(static_cast<int>(id))));
    static_cast<void>(door.set_known(1, true));
    EXPECT_EQ(door.set_held(1, 400, at(10)), std::nullopt);
    EXPECT_EQ(door.set_held(2, 400, at(11)), std::nullopt);
    EXPECT_EQ(door.set_held(3, 400, at(12)), 2u) << "a stranger before one who has shown the key";
    EXPECT_EQ(door.held_bytes(), 800u);
    EXPECT_EQ(door.set_held(3, 0, at(13)), std::nullopt);
    EXPECT_EQ(door.set_held(1, 5000, at(14)), std::nullopt) << "alone, it may be as long as it is";
    door.leave(1);
    EXPECT_EQ(door.held_bytes(), 0u);
}

TEST(Door, WhenTheProcessCanOpenNoMoreSomebodyGoes) {
    Door door{kSmall};
    EXPECT_EQ(door.make_room(), std::nullopt);
    static_cast<void>(door.enter(1, "a", at(1)));
    static_cast<void>(door.enter(2, "a", at(2)));
    static_cast<void>(door.set_known(1, true));
    EXPECT_EQ(door.make_room(), 2u);
    door.set_busy(1, true, at(3));
    EXPECT_EQ(door.make_room(), std::nullopt) << "an upload is worth more than a newcomer";
    door.set_busy(1, false, at(4));
    EXPECT_EQ(door.make_room(), 1u);
}

TEST(DoorLimits, ShrinkWithTheDescriptorsAndKeepSomeOfEach) {
    const DoorLimits whole;
    EXPECT_EQ(whole.within(whole.descriptors()).strangers_max, whole.strangers_max);
    for (const std::size_t descriptors : {0u, 50u, 200u, 300u, 500u, 1024u, 1300u}) {
        const DoorLimits fewer = whole.within(descriptors);
        EXPECT_GE(fewer.strangers_max, 8u);
        EXPECT_GE(fewer.known_max, 8u);
        EXPECT_LE(fewer.strangers_of_address_max, whole.strangers_of_address_max);
        EXPECT_LE(fewer.descriptors(), std::max<std::size_t>(descriptors, 192 + 16)) << descriptors;
    }
}

// ---- the oracle ---------------------------------------------------------------------------------

/// The same rules, as the head of door.h says them, with nothing but a list.
class NaiveDoor {
  public:
    struct Guest {
        Door::Id id;
        std::string address;
        Instant since;
        bool known = false, busy = false;
    };

    Door::Leaver enter(Door::Id id, const std::string& address, Instant now) {
        const Door::Leaver leaver = room(address);
        guests.push_back({id, address, now});
        return leaver;
    }
    Door::Leaver set_known(Door::Id id, bool known) {
        const auto guest = find(id);
        if (guest == guests.end() || guest->known == known) return std::nullopt;
        Guest moved = *guest;
        guests.erase(guest);
        const Door::Leaver leaver = known ? room_for_known() : room(moved.address);
        moved.known = known;
        guests.push_back(moved);
        return leaver;
    }
    void set_busy(Door::Id id, bool busy, Instant now) {
        const auto guest = find(id);
        if (guest == guests.end()) return;
        guest->busy = busy;
        if (!busy) guest->since = now;
    }
    void leave(Door::Id id) {
        std::erase_if(guests, [id](const Guest& guest) { return guest.id == id; });
    }
    std::size_t strangers_of(const std::string& address) const {
        return static_cast<std::size_t>(std::count_if(guests.begin(), guests.end(), [&](const Guest& guest) {
            return !guest.known && guest.address == address;
        }));
    }
    std::size_t known() const {
        return static_cast<std::size_t>(
            std::count_if(guests.begin(), guests.end(), [](const Guest& guest) { return guest.known; }));
    }

    std::vector<Guest> guests;

  private:
    std::vector<Guest>::iterator find(Door::Id id) {
        return std::find_if(guests.begin(), guests.end(),
                            [id](const Guest& guest) { return guest.id == id; });
    }
    template <typename Key>
    Door::Leaver drop_least(const std::vector<Guest>& among, Key key) {
        if (among.empty()) return std::nullopt;
        const Door::Id id = std::min_element(among.begin(), among.end(), [&](const Guest& a, const Guest& b) {
                                return key(a) < key(b);
                            })->id;
        leave(id);
        return id;
    }
    Door::Leaver room(const std::string& address) {
        std::vector<Guest> strangers;
        for (const Guest& guest : guests) {
            if (!guest.known) strangers.push_back(guest);
        }
        if (strangers_of(address) >= kSmall.strangers_of_address_max) {
            std::erase_if(strangers, [&](const Guest& guest) { return guest.address != address; });
        } else if (strangers.size() < kSmall.strangers_max) {
            return std::nullopt;
        }
        std::size_t most = 0;
        for (const Guest& guest : strangers) most = std::max(most, strangers_of(guest.address));
        std::erase_if(strangers, [&](const Guest& guest) { return strangers_of(guest.address) < most; });
        return drop_least(strangers, [](const Guest& guest) { return std::tuple{guest.since, guest.id}; });
    }
    Door::Leaver room_for_known() {
        std::vector<Guest> all;
        for (const Guest& guest : guests) {
            if (guest.known) all.push_back(guest);
        }
        if (all.size() < kSmall.known_max) return std::nullopt;
        return drop_least(all, [](const Guest& guest) {
            return std::tuple{guest.busy, guest.since, guest.id};
        });
    }
};

TEST(DoorProperty, AgreesWithTheNaiveOneAndKeepsItsPromises) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
        std::mt19937 random{seed};
        Door door{kSmall};
        NaiveDoor naive;
        Door::Id next = 1;
        for (int step = 0; step < 3000; ++step) {
            const Instant now = at(step / 3);
            const Door::Id some = next > 12 ? next - random() % 12 : 1 + random() % next;
            const bool flag = random() % 2 == 0;
            Door::Leaver expected, got;
            switch (random() % 5) {
                case 0:
                case 1: {
                    const std::string address(1, static_cast<char>('a' + random() % 3));
                    expected = naive.enter(next, address, now);
                    got = door.enter(next++, address, now);
                    break;
                }
                case 2:
                    expected = naive.set_known(some, flag);
                    got = door.set_known(some, flag);
                    break;
                case 3:
                    naive.set_busy(some, flag, now);
                    door.set_busy(some, flag, now);
                    break;
                default:
                    naive.leave(some);
                    door.leave(some);
            }
            ASSERT_EQ(got, expected) << "seed " << seed << ", step " << step;
            ASSERT_EQ(door.strangers() + door.known(), naive.guests.size());
            ASSERT_EQ(door.known(), naive.known());
            ASSERT_LE(door.strangers(), kSmall.strangers_max);
            ASSERT_LE(door.known(), kSmall.known_max);
            for (const char* address : {"a", "b", "c"})
                ASSERT_LE(naive.strangers_of(address), kSmall.strangers_of_address_max);
        }
    }
}

}  // namespace
}  // namespace qduino::web::door_test
