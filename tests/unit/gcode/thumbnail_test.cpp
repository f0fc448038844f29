#include "printer/preflight/thumbnail.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace qduino::printer::preflight::thumbnail_test {
namespace {

std::string encode(const std::vector<std::uint8_t>& bytes) {
    const char* const digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t group = 0;
        for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (i + k < bytes.size() ? bytes[i + k] : 0U);
        for (std::size_t k = 0; k < 4; ++k) {
            out += i + k > bytes.size() ? '=' : digits[group >> (18 - 6 * k) & 63];
        }
    }
    return out;
}

std::vector<std::uint8_t> picture(std::size_t size, std::uint8_t salt = 0) {
    std::vector<std::uint8_t> bytes{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
    while (bytes.size() < size) bytes.push_back(static_cast<std::uint8_t>(bytes.size() * 37 + salt));
    return bytes;
}

void put(ThumbnailReader& reader, const std::string& size, const std::string& base64,
         std::ptrdiff_t claim_more = 0) {
    const auto claimed = static_cast<std::ptrdiff_t>(base64.size()) + claim_more;
    reader.on_comment(" thumbnail begin " + size + " " + std::to_string(claimed));
    for (std::size_t at = 0; at < base64.size(); at += 78) reader.on_comment(" " + base64.substr(at, 78));
    reader.on_comment(" thumbnail end");
}

TEST(Thumbnail, EveryLengthComesBackWhole) {
    for (std::size_t size = 9; size < 300; ++size) {
        ThumbnailReader reader;
        put(reader, "16x16", encode(picture(size)));
        EXPECT_EQ(reader.best().png, picture(size)) << size;
    }
}

TEST(Thumbnail, TheLargestIsKept) {
    ThumbnailReader reader;
    put(reader, "16x16", encode(picture(50, 1)));
    put(reader, "220x124", encode(picture(400, 2)));
    put(reader, "32x32", encode(picture(60, 3)));
    EXPECT_EQ(reader.best().width_px, 220U);
    EXPECT_EQ(reader.best().height_px, 124U);
    EXPECT_EQ(reader.best().png, picture(400, 2));
}

TEST(Thumbnail, OnlyItsOwnCommentsAreTaken) {
    ThumbnailReader reader;
    EXPECT_FALSE(reader.on_comment("TYPE:FILL"));
    EXPECT_TRUE(reader.on_comment(" thumbnail begin 16x16 12"));
    EXPECT_TRUE(reader.on_comment(" iVBORw0KGgoA"));
    EXPECT_TRUE(reader.on_comment(" thumbnail end"));
    EXPECT_FALSE(reader.on_comment(" thumbnail end"));
}

TEST(Thumbnail, ABadOneIsLeftOut) {
    const std::string good = encode(picture(100));
    const auto left_out = [](const std::string& size, const std::string& text, std::ptrdiff_t more = 0) {
        ThumbnailReader reader;
        put(reader, size, text, more);
        return reader.best().png.empty();
    };
    EXPECT_FALSE(left_out("16x16", good));
    EXPECT_TRUE(left_out("16x16", good, 4)) << "shorter than it says";
    EXPECT_TRUE(left_out("16x16", good, -4)) << "longer than it says";
    EXPECT_TRUE(left_out("16x16", encode(std::vector<std::uint8_t>(100, 7)))) << "no PNG";
    EXPECT_TRUE(left_out("16x16", "!" + good.substr(1))) << "no base64";
    EXPECT_TRUE(left_out("16x16", good.substr(0, 40) + "=" + good.substr(41))) << "padding inside";
    EXPECT_TRUE(left_out("99999x16", good)) << "too wide";
    EXPECT_TRUE(left_out("x", good));
    EXPECT_TRUE(left_out("16x16", encode(picture(kThumbnailBytesMax + 1)))) << "too long";
    EXPECT_FALSE(left_out("16x16", encode(picture(kThumbnailBytesMax)))) << "just fits";
}

TEST(Thumbnail, AnUnfinishedOneIsNotUsed) {
    ThumbnailReader reader;
    const std::string text = encode(picture(100));
    reader.on_comment(" thumbnail begin 16x16 " + std::to_string(text.size()));
    reader.on_comment(" " + text);
    EXPECT_TRUE(reader.best().png.empty());
    put(reader, "8x8", encode(picture(20)));
    EXPECT_EQ(reader.best().png, picture(20));
}

}  // namespace
}  // namespace qduino::printer::preflight::thumbnail_test
