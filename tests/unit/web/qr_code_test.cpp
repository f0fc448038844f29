// The QR code's form; that a reader understands it is tests/e2e/reach.
#include "web/net/qr_code.h"

#include <gtest/gtest.h>

namespace qduino::web::qr_code_test {
namespace {

TEST(QrCode, IsASquareWithItsThreeFinders) {
    const QrCode code =
        qr_code_of("https://192.168.1.5:8080/#key=0123456789abcdefghijklmnopqrstuvwxyzABCDEFG");
    ASSERT_GE(code.size(), 21u);
    for (const std::string& row : code) EXPECT_EQ(row.size(), code.size());
    for (const std::size_t y : {std::size_t{0}, std::size_t{6}, code.size() - 7, code.size() - 1})
        EXPECT_EQ(code[y].substr(0, 8), "11111110") << y;
    EXPECT_EQ(code[0].substr(code.size() - 8), "01111111");
    EXPECT_TRUE(qr_code_of(std::string(10'000, 'a')).empty());
}

TEST(QrCode, ATerminalShowsTwoRowsInEachLine) {
    const std::string picture = terminal_picture({"10", "01"});
    EXPECT_NE(picture.find("  \x1b[30;107m  ▀▄  \x1b[0m\n"), std::string::npos) << picture;
}

}  // namespace
}  // namespace qduino::web::qr_code_test
