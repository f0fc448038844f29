// Plain I2C transactions as SMBus requests.
#include "board/linux/pin/smbus_request.h"

#include <gtest/gtest.h>

#include <array>

namespace qduino::board::linux::test::smbus_request_test {
namespace {

constexpr std::array<std::uint8_t, 4> kBytes{0x8c, 0x12, 0x34, 0x56};

std::optional<SmbusRequest> request(std::size_t out, std::size_t in) {
    return smbus_request(std::span{kBytes}.first(out), in);
}

TEST(SmbusRequest, TranslatesWhatSmbusCanSay) {
    EXPECT_EQ(request(0, 0), (SmbusRequest{I2C_SMBUS_WRITE, 0, I2C_SMBUS_QUICK, 0}));
    EXPECT_EQ(request(0, 1), (SmbusRequest{I2C_SMBUS_READ, 0, I2C_SMBUS_BYTE, 0}));
    EXPECT_EQ(request(1, 0), (SmbusRequest{I2C_SMBUS_WRITE, 0x8c, I2C_SMBUS_BYTE, 0}));
    EXPECT_EQ(request(1, 1), (SmbusRequest{I2C_SMBUS_READ, 0x8c, I2C_SMBUS_BYTE_DATA, 0}));
    EXPECT_EQ(request(1, 2), (SmbusRequest{I2C_SMBUS_READ, 0x8c, I2C_SMBUS_WORD_DATA, 0}));
    EXPECT_EQ(request(2, 0), (SmbusRequest{I2C_SMBUS_WRITE, 0x8c, I2C_SMBUS_BYTE_DATA, 0x12}));
    EXPECT_EQ(request(3, 0), (SmbusRequest{I2C_SMBUS_WRITE, 0x8c, I2C_SMBUS_WORD_DATA, 0x3412}));
}

TEST(SmbusRequest, LeavesOutTheRest) {
    EXPECT_EQ(request(0, 2), std::nullopt);
    EXPECT_EQ(request(1, 3), std::nullopt);
    EXPECT_EQ(request(2, 1), std::nullopt);
    EXPECT_EQ(request(4, 0), std::nullopt);
}

}  // namespace
}  // namespace qduino::board::linux::test::smbus_request_test
