// The light of a remote control, against the flashes that its data sheet draws.
#include "device/nec_remote.h"

#include <gtest/gtest.h>

#include <vector>

namespace qduino::device::nec_remote_test {
namespace {

/// When the light changes until `end`, in microseconds.
std::vector<std::int64_t> changes(const NecRemote& remote, Instant end) {
    std::vector<std::int64_t> at;
    bool on = false;
    for (Instant now = kEpoch; now < end; now += 500ns) {
        if (remote.light(now) != on) at.push_back((now - kEpoch).count() / 1000);
        on = remote.light(now);
    }
    return at;
}

TEST(NecRemote, AFrameHasALeaderAnd32BitsAndALastFlash) {
    const NecRemote remote(kEpoch + 1ms, 0x04, 0x18, 0);
    const auto at = changes(remote, kEpoch + 200ms);
    ASSERT_EQ(at.size(), 2u * (1 + 32 + 1));
    EXPECT_EQ(at[0], 1000);
    EXPECT_EQ(at[1] - at[0], 9000);
    EXPECT_EQ(at[2] - at[1], 4500);
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < 32; ++i) {
        EXPECT_NEAR(static_cast<double>(at[3 + 2 * i] - at[2 + 2 * i]), 562.5, 1);
        const std::int64_t dark = at[4 + 2 * i] - at[3 + 2 * i];
        EXPECT_NEAR(static_cast<double>(dark), dark > 1000 ? 1687.5 : 562.5, 1);
        bits |= std::uint32_t{dark > 1000} << i;
    }
    EXPECT_EQ(bits, 0xE718FB04u) << "address, its inverse, command, its inverse; the lowest bit first";
}

TEST(NecRemote, AHeldKeyRepeats) {
    const NecRemote remote(kEpoch, 1, 2, 2);
    const auto at = changes(remote, kEpoch + 500ms);
    ASSERT_EQ(at.size(), 2u * (1 + 32 + 1) + 2 * 4);
    for (const int frame : {1, 2}) {
        const std::size_t from = 68 + 4 * static_cast<std::size_t>(frame - 1);
        EXPECT_EQ(at[from], 110'000 * frame);
        EXPECT_EQ(at[from + 1] - at[from], 9000);
        EXPECT_EQ(at[from + 2] - at[from + 1], 2250);
        EXPECT_NEAR(static_cast<double>(at[from + 3] - at[from + 2]), 562.5, 1);
    }
}

TEST(NecRemote, NobodyPressesAKeyThatHasNoInstant) {
    EXPECT_TRUE(changes(NecRemote(kForever, 1, 2, 3), kEpoch + 200ms).empty());
}

}  // namespace
}  // namespace qduino::device::nec_remote_test
