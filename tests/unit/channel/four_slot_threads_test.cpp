// The four-slot between two threads: every value read is whole, never older than one read before,
// and never older than what the writer had finished when the read began.

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>

#include "channel/four_slot.h"
#include "tests/unit/channel/payload.h"

namespace qduino::channel::four_slot_threads_test {
namespace {

template <std::size_t Words>
void read_while_writing(std::uint64_t writes) {
    using Value = Payload<Words>;
    auto slot = std::make_unique<FourSlot<Value>>();
    std::atomic<std::uint64_t> finished{0};
    std::thread writer{[&] {
        for (std::uint64_t number = 1; number <= writes; ++number) {
            slot->write(Value::of(number));
            finished.store(number, std::memory_order_release);
            if (number % 1024 == 0) std::this_thread::yield();
        }
    }};
    std::uint64_t newest = 0;
    std::uint64_t distinct = 0;
    std::uint64_t torn = 0;
    std::uint64_t stale = 0;
    while (newest < writes) {
        const std::uint64_t at_least = finished.load(std::memory_order_acquire);
        const Value value = slot->read();
        torn += value.whole() ? 0 : 1;
        stale += value.number < newest || value.number < at_least ? 1 : 0;
        distinct += value.number != newest ? 1 : 0;
        if (torn + stale > 0) break;
        newest = value.number;
    }
    writer.join();
    EXPECT_EQ(torn, 0u);
    EXPECT_EQ(stale, 0u);
    EXPECT_GT(distinct, 0u);
    EXPECT_EQ(slot->read().number, writes);
}

TEST(FourSlotThreads, SmallValues) { read_while_writing<1>(300'000); }
TEST(FourSlotThreads, BigValues) { read_while_writing<62>(60'000); }

}  // namespace
}  // namespace qduino::channel::four_slot_threads_test
