// The places that tests/metal/beside_test.py reads from outside of the machine.
#include "board/window/beside_layout.h"

#include <gtest/gtest.h>

#include <cstddef>

namespace qduino::board::beside_layout_test {
namespace {

TEST(BesideLayout, HasItsWordsWhereTheWitnessReadsThem) {
    EXPECT_EQ(offsetof(BesideArea, board_beats), 512u);
    EXPECT_EQ(offsetof(BesideArea, board_ns), 520u);
    EXPECT_EQ(offsetof(BesideArea, state), 528u);
    EXPECT_EQ(offsetof(BesideArea, status), 532u);
    EXPECT_EQ(offsetof(BesideArea, last_beat_ns), 536u);
    EXPECT_EQ(offsetof(BesideArea, safe_ns), 544u);
    EXPECT_EQ(kBesidePinsOffset, std::size_t{48} << 20);
    EXPECT_EQ(kBesideServiceOffset, std::size_t{182} << 20);
    EXPECT_EQ(kBesideBytes, std::size_t{184} << 20);
    EXPECT_EQ(offsetof(PinsLayout, outputs), 256u);
    EXPECT_EQ(sizeof(OutputPin), 12u);
    EXPECT_EQ(offsetof(OutputPin, level), 1u);
    EXPECT_EQ(ring_offset(0), 196608u);
    EXPECT_EQ(ring_offset(1), 2359296u);
    EXPECT_EQ(NarrowRing::kCapacity, std::size_t{1} << 17);
    EXPECT_EQ(sizeof(NarrowRing) - NarrowRing::kCapacity * sizeof(PinEvent), 256u) << "in front of the slots";
    EXPECT_EQ(offsetof(PinsLayout, writers) + sizeof(WriterSlot) + offsetof(WriterSlot, lost),
              40704u + 64 + 8);
}

}  // namespace
}  // namespace qduino::board::beside_layout_test
