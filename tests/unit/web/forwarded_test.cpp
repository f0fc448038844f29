// The client behind a request: a named proxy's word counts, anybody else's does not.
#include "web/http/forwarded.h"

#include <gtest/gtest.h>

#include "tests/unit/web/web_fixture.h"

namespace qduino::web::forwarded_test {
namespace {

Client client_of(const std::string& peer, std::vector<Header> headers, bool secure = false) {
    RequestHead head;
    head.headers = std::move(headers);
    head.headers.push_back({"Host", "print.example:80"});
    return Proxies{{"127.0.0.1", "::ffff:10.0.0.2", "2001:DB8::1"}}.client_of(head, {peer, secure});
}

TEST(Proxies, ANamedProxysWordCounts) {
    const Client client = client_of("127.0.0.1", {{"X-Forwarded-For", "192.0.2.7"},
                                                  {"x-forwarded-proto", "HTTPS"},
                                                  {"X-Forwarded-Prefix", "/shop/printer-2/"}});
    EXPECT_EQ(client.name, "192.0.2.7");
    EXPECT_TRUE(client.secure);
    EXPECT_EQ(client.prefix, "/shop/printer-2");
    EXPECT_EQ(client.address(), "https://print.example:80/shop/printer-2");
}

TEST(Proxies, AStrangersWordCountsForNothing) {
    for (const char* stranger : {"127.0.0.2", "192.0.2.9", "::1", "2001:db8::2"}) {
        const Client client = client_of(stranger, {{"X-Forwarded-For", "192.0.2.7"},
                                                   {"X-Forwarded-Proto", "https"},
                                                   {"X-Forwarded-Prefix", "/printer"}});
        EXPECT_EQ(client.name, limited_name_of(stranger));
        EXPECT_FALSE(client.secure) << stranger;
        EXPECT_EQ(client.prefix, "") << stranger;
    }
    EXPECT_TRUE(client_of("192.0.2.9", {{"X-Forwarded-Proto", "http"}}, true).secure);
}

TEST(Proxies, TheLastAddressThatIsNoProxyIsTheClients) {
    const auto name = [](std::vector<Header> headers) {
        return client_of("127.0.0.1", std::move(headers)).name;
    };
    EXPECT_EQ(name({{"X-Forwarded-For", "198.51.100.1, 192.0.2.7"}}), "192.0.2.7") << "the first is its word";
    EXPECT_EQ(name({{"X-Forwarded-For", "192.0.2.7, 10.0.0.2,2001:db8::1"}}), "192.0.2.7");
    EXPECT_EQ(name({{"X-Forwarded-For", "198.51.100.1"}, {"X-Forwarded-For", "192.0.2.7"}}), "192.0.2.7");
    EXPECT_EQ(name({{"X-Forwarded-For", "192.0.2.7:4711"}}), "192.0.2.7");
    EXPECT_EQ(name({{"X-Forwarded-For", "[2001:db8:1:2:3::7]:4711"}}), "2001:db8:1:2::/64");
    EXPECT_EQ(name({{"X-Forwarded-For", "2001:db8:1:2:3::7"}}), "2001:db8:1:2::/64");
    EXPECT_EQ(name({{"X-Forwarded-For", "::ffff:192.0.2.7"}}), "192.0.2.7");
    EXPECT_EQ(name({}), "127.0.0.1");
    for (const char* malformed :
         {"", ",", "unknown", "192.0.2.7,", "192.0.2.7, x", "[", "192.0.2.999", "_hidden"})
        EXPECT_EQ(name({{"X-Forwarded-For", malformed}}), "127.0.0.1") << malformed;
    EXPECT_EQ(name({{"X-Forwarded-For", "x, 10.0.0.2"}}), "10.0.0.2");
}

TEST(Proxies, WhatIsDoubledOrMalformedCountsForNothing) {
    EXPECT_FALSE(
        client_of("127.0.0.1", {{"X-Forwarded-Proto", "https"}, {"X-Forwarded-Proto", "https"}}).secure);
    EXPECT_FALSE(client_of("127.0.0.1", {{"X-Forwarded-Proto", "https, http"}}).secure);
    EXPECT_FALSE(client_of("127.0.0.1", {{"X-Forwarded-Proto", "http"}}, true).secure);
    for (const std::string& bad :
         {std::string{"printer"}, std::string{"/a; Domain=evil"}, std::string{"/a b"},
          std::string{"//evil.example"}, std::string{"/a/../b"}, std::string{"/%2f"},
          std::string{"/a\r\nX: y"}, "/" + std::string(200, 'a')})
        EXPECT_EQ(client_of("127.0.0.1", {{"X-Forwarded-Prefix", bad}}).prefix, "") << bad;
    EXPECT_EQ(client_of("127.0.0.1", {{"X-Forwarded-Prefix", "/"}}).prefix, "");
}

using ForwardedTest = WebTest;

TEST_F(ForwardedTest, WhoSaysNoHostHasCalledTheAddressThatHeCameTo) {
    const Client client = Proxies{}.client_of({}, {.address = "192.0.2.7", .reached = "192.0.2.1:8080"});
    EXPECT_EQ(client.address(), "http://192.0.2.1:8080");
    // An empty one is said, and is no name of ours.
    RequestHead empty;
    empty.headers.push_back({"Host", ""});
    EXPECT_EQ(Proxies{}.client_of(empty, {.address = "192.0.2.7"}).host, "");
    const std::string key = std::string{"X-Api-Key: "} + kKey + "\r\n";
    EXPECT_EQ(send("GET /api/version HTTP/1.0\r\n" + key + "\r\n").status, 200);
    EXPECT_EQ(send("GET /api/version HTTP/1.0\r\n\r\n").status, 401);
    EXPECT_EQ(send("GET /api/version HTTP/1.0\r\nHost: evil.example\r\n" + key + "\r\n").status, 403);
    EXPECT_EQ(send("GET /api/version HTTP/1.0\r\nHost: \r\n" + key + "\r\n").status, 403);
    EXPECT_EQ(send("GET /api/version HTTP/1.1\r\n" + key + "\r\n").status, 400);
}

std::string login_with(const std::string& key, const std::string& fields) {
    const std::string body = R"({"key":")" + key + "\"}";
    return "POST /api/v1/session HTTP/1.1\r\nHost: printer.local\r\n" + fields +
           "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
}

TEST_F(ForwardedTest, TheCookieIsSecureAndKeepsToThePrefix) {
    const std::string fields = "X-Forwarded-Proto: https\r\nX-Forwarded-Prefix: /printer\r\n";
    const std::string behind = send(login_with(kKey, fields), "127.0.0.9").header("Set-Cookie");
    EXPECT_NE(behind.find("; Path=/printer/; Secure; HttpOnly"), std::string::npos) << behind;
    const std::string forged = send(login_with(kKey, fields), "127.0.0.8").header("Set-Cookie");
    EXPECT_NE(forged.find("; Path=/; HttpOnly"), std::string::npos) << forged;
    secure_ = true;
    const std::string by_tls = send(login_with(kKey, ""), "127.0.0.8").header("Set-Cookie");
    EXPECT_NE(by_tls.find("; Path=/; Secure; HttpOnly"), std::string::npos) << by_tls;
}

TEST_F(ForwardedTest, AnInvitationSignsInOnceUnderTheNameThatTheInviterSees) {
    const std::string fields = "X-Forwarded-Proto: https\r\nX-Forwarded-Prefix: /printer\r\nX-Api-Key: ";
    const Answer made =
        send("POST /api/v1/invitation HTTP/1.1\r\nHost: printer.local\r\n" + fields + kKey + "\r\n\r\n",
             "127.0.0.9");
    ASSERT_EQ(made.status, 201);
    const std::string link = made.json()["url"];
    const std::string start = "https://printer.local/printer/#ticket=";
    ASSERT_TRUE(link.starts_with(start)) << link;
    const std::string body = R"({"ticket":")" + link.substr(start.size()) + "\"}";
    const std::string login = "POST /api/v1/session HTTP/1.1\r\nHost: printer.local\r\nContent-Length: " +
                              std::to_string(body.size()) + "\r\n\r\n" + body;
    const Answer first = send(login), second = send(login);
    EXPECT_EQ(first.status, 204);
    EXPECT_NE(first.header("Set-Cookie"), "");
    EXPECT_EQ(second.status, 401) << "a second phone cannot use it";
    EXPECT_EQ(request("POST /api/v1/invitation").status, 404) << "only this computer can come";
    EXPECT_EQ(send("POST /api/v1/invitation HTTP/1.1\r\nHost: printer.local\r\n\r\n").status, 401);
}

TEST_F(ForwardedTest, WrongKeysCountForTheClientAndNotForTheProxy) {
    const auto status = [&](const std::string& from, const std::string& by) {
        return send(login_with("wrong", "X-Forwarded-For: " + from + "\r\n"), by).status;
    };
    for (int i = 0; i < FailureLimiter::kBurst; ++i) EXPECT_EQ(status("192.0.2.7", "127.0.0.9"), 401);
    EXPECT_EQ(status("192.0.2.7", "127.0.0.9"), 429);
    EXPECT_EQ(status("192.0.2.8", "127.0.0.9"), 401) << "another client of the same proxy";
    for (int i = 0; i < FailureLimiter::kBurst; ++i) {
        EXPECT_EQ(status("192.0.2." + std::to_string(100 + i), "127.0.0.8"), 401);
    }
    EXPECT_EQ(status("192.0.2.200", "127.0.0.8"), 429) << "who is no proxy cannot change his name";
}

}  // namespace
}  // namespace qduino::web::forwarded_test
