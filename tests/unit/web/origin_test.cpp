#include "web/http/origin.h"

#include <gtest/gtest.h>

namespace qduino::web::origin_test {
namespace {

bool is_same_origin(const RequestHead& head, bool absent_is_same, bool secure = false) {
    return web::is_same_origin(head, {.secure = secure, .host = std::string{head.value("Host")}},
                               absent_is_same);
}

TEST(HostPolicy, AllowsAddressesLocalhostAndNamesOfTheOwner) {
    const HostPolicy policy{{"printer.local"}};
    for (const char* good : {"localhost", "LOCALHOST:8080", "127.0.0.1", "127.0.0.1:5000", "192.168.1.7:80",
                             "[::1]", "[::1]:8080", "printer.local", "Printer.Local:80"}) {
        EXPECT_TRUE(policy.allows(good)) << good;
    }
    for (const char* bad :
         {"", "evil.example", "evil.example:8080", "localhost.evil.example", "printer.local.evil",
          "127.0.0.1.evil.example", "localhost:", "localhost:x", "localhost:123456", "[::1", "::1", "[zz]",
          "a@localhost", ":80", "127.0.0.1@evil"}) {
        EXPECT_FALSE(policy.allows(bad)) << bad;
    }
}

RequestHead from(const char* origin, const char* host) {
    RequestHead head;
    head.headers.push_back({"Host", host});
    if (origin) head.headers.push_back({"Origin", origin});
    return head;
}

TEST(Origin, MustBeTheHostThatWasAsked) {
    EXPECT_TRUE(is_same_origin(from("http://localhost:8080", "localhost:8080"), false));
    EXPECT_TRUE(is_same_origin(from("https://printer.local", "printer.local"), false));
    EXPECT_FALSE(is_same_origin(from("http://localhost:8081", "localhost:8080"), false))
        << "another port is another site";
    EXPECT_FALSE(is_same_origin(from("http://evil.example", "localhost:8080"), true));
    EXPECT_FALSE(is_same_origin(from("null", "localhost"), true));
    EXPECT_FALSE(is_same_origin(from("", "localhost"), true));
    EXPECT_FALSE(is_same_origin(from("ftp://localhost", "localhost"), true));
    EXPECT_TRUE(is_same_origin(from(nullptr, "localhost"), true));
    EXPECT_FALSE(is_same_origin(from(nullptr, "localhost"), false));
    EXPECT_TRUE(is_same_origin(from("https://printer.local", "printer.local"), false, true));
    EXPECT_FALSE(is_same_origin(from("http://printer.local", "printer.local"), false, true))
        << "whoever can change what is sent plainly may have made that page";
}

}  // namespace
}  // namespace qduino::web::origin_test
