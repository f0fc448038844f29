#include "channel/four_slot.h"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <random>

#include "tests/unit/channel/payload.h"

namespace qduino::channel::four_slot_test {
namespace {

static_assert(std::is_standard_layout_v<FourSlot<int>>);

TEST(FourSlot, ReadsWhatWasWrittenLast) {
    FourSlot<int> slot;
    EXPECT_EQ(slot.read(), 0);
    slot.write(1);
    EXPECT_EQ(slot.read(), 1);
    EXPECT_EQ(slot.read(), 1);
    slot.write(2);
    slot.write(3);
    EXPECT_EQ(slot.read(), 3);
}

TEST(FourSlot, AgreesWithAVariable) {
    std::mt19937_64 random{17};
    FourSlot<Payload<4>> slot;
    std::uint64_t last = 0;
    for (std::uint64_t i = 1; i < 20'000; ++i) {
        if (random() % 2 == 0) {
            slot.write(Payload<4>::of(i));
            last = i;
        } else {
            ASSERT_EQ(slot.read().number, last);
        }
    }
}

TEST(FourSlot, ZeroedMemoryHoldsAZeroedValue) {
    using Slot = FourSlot<std::uint64_t>;
    alignas(Slot) std::byte bytes[sizeof(Slot)];
    std::memset(bytes, 0, sizeof bytes);
    Slot& slot = *reinterpret_cast<Slot*>(bytes);
    EXPECT_EQ(slot.read(), 0u);
    slot.write(9);
    EXPECT_EQ(slot.read(), 9u);
}

TEST(FourSlot, DamagedControlBytesStayInsideTheSlots) {
    using Slot = FourSlot<std::uint64_t>;
    alignas(Slot) std::byte bytes[sizeof(Slot)];
    for (int fill = 0; fill < 256; ++fill) {
        std::memset(bytes, fill, 2 * kCacheLine);  // the control variables; the slots hold zeroes
        std::memset(bytes + 2 * kCacheLine, 0, sizeof bytes - 2 * kCacheLine);
        Slot& slot = *reinterpret_cast<Slot*>(bytes);
        EXPECT_EQ(slot.read(), 0u);
        slot.write(7);
        slot.write(8);
        EXPECT_EQ(slot.read(), 8u) << "fill " << fill;
    }
}

}  // namespace
}  // namespace qduino::channel::four_slot_test
