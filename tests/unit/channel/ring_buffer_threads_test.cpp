// The ring between two threads: nothing lost, nothing doubled, nothing torn, nothing out of order.

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <random>
#include <thread>

#include "channel/ring_buffer.h"
#include "tests/unit/channel/payload.h"

namespace qduino::channel::ring_buffer_threads_test {
namespace {

using Item = Payload<6>;
constexpr std::uint64_t kItems = 120'000;
/// Through a single slot each item is a switch of threads: where both have one busy core, some
/// milliseconds.
constexpr std::uint64_t kItemsOneByOne = 3'000;

template <std::size_t N, typename Push, typename Pop>
void pass_all(Push push, Pop pop, std::uint64_t items = kItems) {
    auto ring = std::make_unique<RingBuffer<Item, N>>();
    std::thread writer{[&] {
        for (std::uint64_t number = 1; number <= items;) {
            const std::uint64_t pushed = push(*ring, number);
            if (pushed == 0) std::this_thread::yield();
            number += pushed;
        }
    }};
    std::uint64_t expected = 1;
    bool good = true;
    while (expected <= items && good) {
        const std::uint64_t before = expected;
        pop(*ring, [&](const Item& item) { good = good && item.number == expected++ && item.whole(); });
        if (expected == before) std::this_thread::yield();
    }
    EXPECT_TRUE(good) << "at item " << expected - 1;
    // Let the writer end.
    for (Item item; !good && expected <= items;) expected += ring->try_pop(item) ? 1 : 0;
    writer.join();
    EXPECT_TRUE(ring->empty());
}

template <typename Ring>
std::uint64_t push_one(Ring& ring, std::uint64_t number) {
    return ring.try_push(Item::of(number)) ? 1 : 0;
}

template <typename Ring>
std::uint64_t push_batch(Ring& ring, std::uint64_t number) {
    std::array<Item, 13> items;
    const std::uint64_t count = std::min<std::uint64_t>(1 + number % items.size(), kItems + 1 - number);
    for (std::uint64_t i = 0; i < count; ++i) items[i] = Item::of(number + i);
    return ring.push_some({items.data(), count});
}

TEST(RingBufferThreads, OneByOne) {
    pass_all<8>([](auto& ring, std::uint64_t number) { return push_one(ring, number); },
                [](auto& ring, auto take) {
                    Item item;
                    if (ring.try_pop(item)) take(item);
                });
}

TEST(RingBufferThreads, ThroughASingleSlot) {
    pass_all<1>([](auto& ring, std::uint64_t number) { return push_one(ring, number); },
                [](auto& ring, auto take) {
                    Item item;
                    if (ring.try_pop(item)) take(item);
                },
                kItemsOneByOne);
}

TEST(RingBufferThreads, InBatches) {
    pass_all<64>([](auto& ring, std::uint64_t number) { return push_batch(ring, number); },
                 [](auto& ring, auto take) {
                     std::array<Item, 9> items;
                     const std::size_t count = ring.pop_some(items);
                     for (std::size_t i = 0; i < count; ++i) take(items[i]);
                 });
}

TEST(RingBufferThreads, LookingAheadInPlace) {
    pass_all<16>([](auto& ring, std::uint64_t number) { return push_batch(ring, number); },
                 [](auto& ring, auto take) {
                     const Item* third = ring.peek(2);
                     EXPECT_TRUE(!third || third->whole());
                     const Item* item = ring.front();
                     if (!item) return;
                     take(*item);
                     ring.pop();
                 });
}

}  // namespace
}  // namespace qduino::channel::ring_buffer_threads_test
