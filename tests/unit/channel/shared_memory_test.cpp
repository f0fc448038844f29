// Ring and four-slot in a page shared by two processes, as the link between sketch and service has
// them; and a side that dies and is replaced.

#include <gtest/gtest.h>
#include <sched.h>

#include <atomic>
#include <csignal>

#include "channel/four_slot.h"
#include "channel/ring_buffer.h"
#include "tests/unit/channel/payload.h"
#include "tests/unit/channel/shared_mapping.h"

namespace qduino::channel::shared_memory_test {
namespace {

using Item = Payload<3>;
using Ring = RingBuffer<Item, 32>;
constexpr std::uint64_t kItems = 20'000;

/// Reads `from`…`to` off the ring; 0 when each is next and whole.
int read_range(Ring& ring, std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t expected = from; expected <= to;) {
        Item item;
        if (!ring.try_pop(item)) {
            sched_yield();
            continue;
        }
        if (item.number != expected || !item.whole()) return 1;
        ++expected;
    }
    return 0;
}

void write_range(Ring& ring, std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t number = from; number <= to;) {
        if (ring.try_push(Item::of(number))) {
            ++number;
        } else {
            sched_yield();
        }
    }
}

TEST(SharedMemory, ARingCarriesItemsBetweenProcesses) {
    SharedMapping<Ring> ring;
    const pid_t reader = in_child([&] { return read_range(*ring, 1, kItems); });
    write_range(*ring, 1, kItems);
    EXPECT_EQ(exit_status_of(reader), 0);
    EXPECT_TRUE(ring->empty());
}

TEST(SharedMemory, AReaderThatDiedIsReplacedWhereItStopped) {
    SharedMapping<Ring> ring;
    const pid_t first = in_child([&] { return read_range(*ring, 1, 500); });
    write_range(*ring, 1, 500);
    ASSERT_EQ(exit_status_of(first), 0);
    const pid_t second = in_child([&] {
        ring->adopt_reader();
        return read_range(*ring, ring->popped() + 1, kItems);
    });
    write_range(*ring, 501, kItems);
    EXPECT_EQ(exit_status_of(second), 0);
}

/// Killed at any moment, the writer leaves a ring that holds whole items, and its successor goes on
/// at pushed() + 1.
TEST(SharedMemory, AKilledWriterIsReplacedWithoutLossOrDoubling) {
    for (int round = 0; round < 20; ++round) {
        SharedMapping<Ring> ring;
        const pid_t first = in_child([&] { return write_range(*ring, 1, ~std::uint64_t{0}), 0; });
        const std::uint64_t some = 200 + static_cast<std::uint64_t>(round) * 37;
        ASSERT_EQ(read_range(*ring, 1, some), 0);
        kill(first, SIGKILL);
        EXPECT_EQ(exit_status_of(first), -SIGKILL);
        const std::uint64_t last = some + 1000;
        const pid_t second = in_child([&] {
            ring->adopt_writer();
            return write_range(*ring, ring->pushed() + 1, last), 0;
        });
        EXPECT_EQ(read_range(*ring, some + 1, last), 0) << "round " << round;
        EXPECT_EQ(exit_status_of(second), 0);
    }
}

TEST(SharedMemory, AFourSlotShowsTheFreshestAcrossProcesses) {
    SharedMapping<FourSlot<Item>> slot;
    const pid_t writer = in_child([&] {
        for (std::uint64_t number = 1; number <= kItems; ++number) slot->write(Item::of(number));
        return 0;
    });
    std::uint64_t newest = 0;
    while (newest < kItems) {
        const Item item = slot->read();
        ASSERT_TRUE(item.whole());
        ASSERT_GE(item.number, newest);
        newest = item.number;
    }
    EXPECT_EQ(exit_status_of(writer), 0);
}

/// A writer killed in the middle of a write does not harm what is read, and the next writer goes
/// on.
TEST(SharedMemory, AKilledWriterLeavesTheLastWholeValue) {
    for (int round = 0; round < 20; ++round) {
        SharedMapping<FourSlot<Item>> slot;
        const pid_t writer = in_child([&] {
            for (std::uint64_t number = 1;; ++number) slot->write(Item::of(number));
            return 0;
        });
        while (slot->read().number < 100) sched_yield();
        kill(writer, SIGKILL);
        EXPECT_EQ(exit_status_of(writer), -SIGKILL);
        const Item last = slot->read();
        ASSERT_TRUE(last.whole());
        ASSERT_EQ(slot->read().number, last.number);
        slot->write(Item::of(last.number + 1));
        ASSERT_EQ(slot->read().number, last.number + 1);
    }
}

}  // namespace
}  // namespace qduino::channel::shared_memory_test
