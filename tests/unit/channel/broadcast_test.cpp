// One writer and several readers at once: each reads whole values, never older than one that it has
// read before, and never older than what the writer had finished when the read began.
#include "channel/broadcast.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "tests/unit/channel/payload.h"

namespace qduino::channel::broadcast_test {
namespace {

template <typename T, std::size_t Readers>
struct Slots {
    std::array<FourSlot<T>, Readers> slots{};
    Broadcast<T, Readers> broadcast() {
        std::array<FourSlot<T>*, Readers> all{};
        for (std::size_t i = 0; i < Readers; ++i) all[i] = &slots[i];
        return Broadcast<T, Readers>{all};
    }
};

TEST(Broadcast, EachReaderHasTheFreshestValueWheneverItReads) {
    Slots<int, 3> slots;
    Broadcast<int, 3> broadcast = slots.broadcast();
    EXPECT_EQ(slots.slots[2].read(), 0);
    broadcast.write(1);
    EXPECT_EQ(slots.slots[0].read(), 1);
    broadcast.write(2);
    broadcast.write(3);
    for (const FourSlot<int>& slot : slots.slots) EXPECT_EQ(slot.read(), 3);
}

template <std::size_t Words>
struct Seen {
    std::uint64_t torn = 0;
    std::uint64_t stale = 0;

    void read_until(const FourSlot<Payload<Words>>& slot, const std::atomic<std::uint64_t>& finished,
                    std::uint64_t writes) {
        for (std::uint64_t newest = 0; newest < writes && torn + stale == 0;) {
            const std::uint64_t at_least = finished.load(std::memory_order_acquire);
            const Payload<Words> value = slot.read();
            torn += value.whole() ? 0 : 1;
            stale += value.number < newest || value.number < at_least ? 1 : 0;
            newest = value.number;
        }
    }
};

template <std::size_t Words, std::size_t Readers>
void read_while_writing(std::uint64_t writes) {
    auto slots = std::make_unique<Slots<Payload<Words>, Readers>>();
    Broadcast<Payload<Words>, Readers> broadcast = slots->broadcast();
    std::atomic<std::uint64_t> finished{0};
    std::array<Seen<Words>, Readers> seen{};
    std::vector<std::thread> readers;
    for (std::size_t i = 0; i < Readers; ++i)
        readers.emplace_back([&, i] { seen[i].read_until(slots->slots[i], finished, writes); });
    for (std::uint64_t number = 1; number <= writes; ++number) {
        broadcast.write(Payload<Words>::of(number));
        finished.store(number, std::memory_order_release);
        if (number % 1024 == 0) std::this_thread::yield();
    }
    for (std::thread& reader : readers) reader.join();
    for (const Seen<Words>& one : seen) {
        EXPECT_EQ(one.torn, 0u);
        EXPECT_EQ(one.stale, 0u);
    }
}

TEST(BroadcastThreads, TwoReadersOfSmallValues) { read_while_writing<1, 2>(100'000); }
TEST(BroadcastThreads, ThreeReadersOfBigValues) { read_while_writing<62, 3>(20'000); }

}  // namespace
}  // namespace qduino::channel::broadcast_test
