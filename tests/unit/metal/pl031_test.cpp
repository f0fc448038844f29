#include "board/metal/driver/pl031.h"

#include <gtest/gtest.h>

#include <array>

namespace qduino::board::metal::pl031_test {
namespace {

TEST(Pl031, SaysItsSecondsWhereItCounts) {
    std::array<std::uint32_t, 4> registers{0xfedc'ba98, 0, 0, 1};
    const auto at = reinterpret_cast<std::uint64_t>(registers.data());
    EXPECT_EQ(read_pl031_date(at), 0xfedc'ba98) << "beyond 2038";
    registers[3] = 0;
    EXPECT_EQ(read_pl031_date(at), std::nullopt) << "it does not count";
    EXPECT_EQ(read_pl031_date(0), std::nullopt) << "there is none";
}

}  // namespace
}  // namespace qduino::board::metal::pl031_test
