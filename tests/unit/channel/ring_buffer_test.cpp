#include "channel/ring_buffer.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>
#include <memory>
#include <numeric>
#include <vector>

namespace qduino::channel::ring_buffer_test {
namespace {

static_assert(std::is_standard_layout_v<RingBuffer<int, 4>>, "its bytes mean the same in every process");
static_assert(std::is_trivially_destructible_v<RingBuffer<int, 4>>);

TEST(RingBuffer, FirstInFirstOut) {
    RingBuffer<int, 4> ring;
    EXPECT_TRUE(ring.empty());
    EXPECT_TRUE(ring.try_push(1));
    EXPECT_TRUE(ring.try_push(2));
    EXPECT_EQ(ring.size(), 2u);
    int item = 0;
    EXPECT_TRUE(ring.try_pop(item));
    EXPECT_EQ(item, 1);
    EXPECT_TRUE(ring.try_pop(item));
    EXPECT_EQ(item, 2);
}

TEST(RingBuffer, EveryOneOfNSlotsIsUsable) {
    RingBuffer<int, 4> ring;
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(ring.try_push(i));
    EXPECT_FALSE(ring.try_push(99));
    EXPECT_EQ(ring.free(), 0u);
    EXPECT_EQ(ring.size(), 4u);
    int item = -1;
    for (int i = 0; i < 4; ++i) {
        EXPECT_TRUE(ring.try_pop(item));
        EXPECT_EQ(item, i);
    }
}

TEST(RingBuffer, PoppingFromAnEmptyRingChangesNothing) {
    RingBuffer<int, 4> ring;
    int item = 7;
    EXPECT_FALSE(ring.try_pop(item));
    EXPECT_EQ(item, 7);
    EXPECT_EQ(ring.front(), nullptr);
    EXPECT_EQ(ring.peek(3), nullptr);
}

TEST(RingBuffer, ManyAtOnceFitInPart) {
    RingBuffer<int, 8> ring;
    std::array<int, 11> items;
    std::iota(items.begin(), items.end(), 0);
    EXPECT_EQ(ring.push_some(items), 8u);
    EXPECT_EQ(ring.push_some(items), 0u);
    EXPECT_EQ(ring.push_some({}), 0u);
    std::array<int, 5> out{};
    EXPECT_EQ(ring.pop_some(out), 5u);
    EXPECT_EQ(out, (std::array<int, 5>{0, 1, 2, 3, 4}));
    EXPECT_EQ(ring.push_some(items), 5u);  // wraps
    std::array<int, 20> rest{};
    EXPECT_EQ(ring.pop_some(rest), 8u);
    EXPECT_EQ((std::vector<int>{rest.begin(), rest.begin() + 8}), (std::vector<int>{5, 6, 7, 0, 1, 2, 3, 4}));
    EXPECT_EQ(ring.pop_some(rest), 0u);
}

TEST(RingBuffer, AFrameIsPushedWholeOrNotAtAll) {
    RingBuffer<int, 8> ring;
    const std::array<int, 5> frame{1, 2, 3, 4, 5};
    EXPECT_TRUE(ring.try_push_all(frame));
    EXPECT_FALSE(ring.try_push_all(frame));
    EXPECT_EQ(ring.size(), 5u);
    const std::array<int, 9> too_long{};
    EXPECT_FALSE((RingBuffer<int, 8>{}.try_push_all(too_long)));
}

TEST(RingBuffer, PeeksAheadWithoutTaking) {
    RingBuffer<int, 4> ring;
    for (int i = 10; i < 13; ++i) ASSERT_TRUE(ring.try_push(i));
    EXPECT_EQ(*ring.front(), 10);
    EXPECT_EQ(*ring.peek(2), 12);
    EXPECT_EQ(ring.peek(3), nullptr);
    EXPECT_EQ(ring.size(), 3u);
    ring.pop();
    EXPECT_EQ(*ring.front(), 11);
    EXPECT_EQ(ring.pushed(), 3u);
    EXPECT_EQ(ring.popped(), 1u);
}

TEST(RingBuffer, DiscardingLeavesItEmptyForTheReaderToo) {
    RingBuffer<int, 16> ring;
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(ring.try_push(i));
    ASSERT_NE(ring.front(), nullptr);  // the reader now keeps a copy of the writer's counter …
    for (int i = 3; i < 9; ++i) ASSERT_TRUE(ring.try_push(i));
    ring.discard_all();  // … which must not lie behind its own
    EXPECT_TRUE(ring.empty());
    EXPECT_EQ(ring.front(), nullptr);
    ASSERT_TRUE(ring.try_push(42));
    ASSERT_NE(ring.front(), nullptr);
    EXPECT_EQ(*ring.front(), 42);
    EXPECT_EQ(ring.peek(1), nullptr);
}

/// A ring in raw memory whose counters can be set: head first, tail two cache lines later.
template <typename Ring>
struct RawRing {
    RawRing() { std::memset(bytes.get(), 0, sizeof(Ring)); }
    void set_counters(std::uint64_t head, std::uint64_t tail) {
        std::memcpy(bytes.get(), &head, sizeof head);
        std::memcpy(bytes.get() + kLinePair, &tail, sizeof tail);
        ring().adopt_writer();
        ring().adopt_reader();
    }
    Ring& ring() { return *reinterpret_cast<Ring*>(bytes.get()); }

    struct Free {
        void operator()(std::byte* at) const { ::operator delete[](at, std::align_val_t{kLinePair}); }
    };
    std::unique_ptr<std::byte[], Free> bytes{
        static_cast<std::byte*>(::operator new[](sizeof(Ring), std::align_val_t{kLinePair}))};
};

TEST(RingBuffer, ZeroedMemoryIsAnEmptyRing) {
    RawRing<RingBuffer<int, 4>> raw;
    EXPECT_TRUE(raw.ring().empty());
    EXPECT_EQ(raw.ring().front(), nullptr);
    EXPECT_TRUE(raw.ring().try_push(5));
    EXPECT_EQ(*raw.ring().front(), 5);
}

TEST(RingBuffer, CountersMayWrap) {
    RawRing<RingBuffer<int, 4>> raw;
    const std::uint64_t last = std::numeric_limits<std::uint64_t>::max();
    raw.set_counters(last - 1, last - 1);
    for (int i = 0; i < 20; ++i) {
        ASSERT_TRUE(raw.ring().try_push(2 * i));
        ASSERT_TRUE(raw.ring().try_push(2 * i + 1));
        ASSERT_EQ(raw.ring().size(), 2u);
        int item = -1;
        ASSERT_TRUE(raw.ring().try_pop(item));
        ASSERT_EQ(item, 2 * i);
        ASSERT_TRUE(raw.ring().try_pop(item));
        ASSERT_EQ(item, 2 * i + 1);
    }
}

/// Whatever a damaged page says, nothing outside the ring is touched and no more than N items are
/// claimed.
TEST(RingBuffer, DamagedCountersStayInsideTheRing) {
    using Ring = RingBuffer<std::uint32_t, 8>;
    const std::uint64_t big = 0xdead'beef'0000'0000u;
    for (const auto& [head, tail] :
         {std::pair{big, std::uint64_t{3}}, std::pair{std::uint64_t{3}, big},
          std::pair{std::uint64_t{0}, std::uint64_t{1}}, std::pair{big + 9, big}}) {
        RawRing<Ring> raw;
        raw.set_counters(head, tail);
        EXPECT_LE(raw.ring().size(), Ring::kCapacity);
        EXPECT_LE(raw.ring().free(), Ring::kCapacity);
        std::array<std::uint32_t, 64> items{};
        EXPECT_LE(raw.ring().push_some(items), Ring::kCapacity);
        raw.set_counters(head, tail);
        EXPECT_LE(raw.ring().pop_some(items), Ring::kCapacity);
    }
}

TEST(RingBuffer, AWriterThatDiedBeforeReleasingLeavesTheRingAsItWas) {
    RawRing<RingBuffer<std::uint32_t, 4>> raw;
    ASSERT_TRUE(raw.ring().try_push(1));
    const std::uint32_t half_written = 0xffff'ffff;  // in the next slot; head was never moved
    std::memcpy(raw.bytes.get() + sizeof(raw.ring()) - kLinePair + sizeof(std::uint32_t), &half_written,
                sizeof half_written);
    raw.ring().adopt_writer();
    EXPECT_EQ(raw.ring().size(), 1u);
    ASSERT_TRUE(raw.ring().try_push(2));
    std::array<std::uint32_t, 4> items{};
    EXPECT_EQ(raw.ring().pop_some(items), 2u);
    EXPECT_EQ(items[1], 2u);
}

}  // namespace
}  // namespace qduino::channel::ring_buffer_test
