// The table of routes as a whole: who is let in, and what docs/api.md says of it.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "base/words.h"
#include "tests/unit/web/web_fixture.h"

namespace qduino::web::route_test {
namespace {

using api::Body;
using api::Guard;
using api::Route;
using api::Thread;

constexpr Words<Method::get, Method::other> kMethods{"GET",   "HEAD",   "POST", "PUT",
                                                     "PATCH", "DELETE", "OTHER"};

class RouteTest : public WebTest {
  protected:
    static std::vector<Route> routes() {
        std::vector<Route> all;
        for (const std::span<const Route> some : api::all_routes())
            all.insert(all.end(), some.begin(), some.end());
        return all;
    }
    /// A request that fits the route's path, without a key; a login has a wrong one.
    static std::string stranger_at(const Route& route) {
        std::string path;
        for (const char c : route.pattern)
            path += c == '*' ? (path.back() == '7' ? "" : "7") : std::string{c};
        const std::string body = route.guard == Guard::login ? R"({"key":"a wrong key"})" : "";
        const std::string stream =
            "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: "
            "AAAAAAAAAAAAAAAAAAAAAA==\r\n";
        return std::string{kMethods(route.method)} + " " + path + " HTTP/1.1\r\nHost: localhost\r\n" +
               (route.body == Body::live ? stream : "") + "Content-Length: " + std::to_string(body.size()) +
               "\r\n\r\n" + body;
    }
    static std::string row_of(const Route& route) {
        constexpr std::array kNeeds{"key", "key in the request", "key or ticket", "key, or a greeted address",
                                    "nothing"};
        constexpr std::array kBodies{"", "upload", "live stream", ""};
        return "| `" + std::string{kMethods(route.method)} + " " + std::string{route.pattern} + "` | " +
               kNeeds[static_cast<std::size_t>(route.guard)] + " | " +
               (route.thread == Thread::io ? "at once" : "") + " | " +
               kBodies[static_cast<std::size_t>(route.body)] + " |\n";
    }
};

TEST_F(RouteTest, EveryRouteAnswers401WithoutTheKeyUnlessItsGuardSaysNone) {
    for (const Route& route : routes()) {
        const int status = send(stranger_at(route)).status;
        // What greets by its own interface's rules answers a wrong key with "err", and is done.
        const bool says_err = route.guard == Guard::login && route.body == Body::none;
        EXPECT_EQ(status, route.guard == Guard::none || says_err ? 200 : 401)
            << kMethods(route.method) << " " << route.pattern;
    }
}

TEST_F(RouteTest, OnlyTheHealthCheckNeedsNothing) {
    for (const Route& route : routes()) {
        EXPECT_EQ(route.guard == Guard::none, route.pattern == "/healthz") << route.pattern;
    }
}

TEST_F(RouteTest, EveryRowIsWhole) {
    for (const Route& route : routes()) {
        EXPECT_EQ(route.handler == nullptr, route.body == Body::live) << route.pattern;
        EXPECT_EQ(route.open != nullptr, route.body == Body::upload) << route.pattern;
    }
}

TEST_F(RouteTest, NoRowHidesBehindAnotherOne) {
    for (const Route& route : routes()) {
        RequestHead head;
        head.method = route.method;
        std::string_view rest = route.pattern;
        while (!rest.empty()) {
            rest.remove_prefix(1);
            const std::string_view segment = rest.substr(0, rest.find('/'));
            head.path.emplace_back(segment.starts_with('*') ? "7" : segment);
            rest.remove_prefix(segment.size());
        }
        const api::Match match = api::find_route(head);
        ASSERT_NE(match.route, nullptr) << route.pattern;
        EXPECT_EQ(match.route->pattern, route.pattern);
        EXPECT_EQ(match.route->method, route.method) << route.pattern;
    }
}

TEST_F(RouteTest, AKnownPathWithAnotherMethodIsRefusedAfterTheKeyWasShown) {
    EXPECT_EQ(request("POST /metrics").status, 405);
    EXPECT_EQ(request("GET /api/v1/session").status, 405);
    EXPECT_EQ(request("GET /api/v1/machine/emergency-stop").status, 405);
    EXPECT_EQ(request("HEAD /api/v1/live").status, 405);
    EXPECT_EQ(request("GET /api/v1/jobs/7/no/such").status, 404) << "uploads take any name, but by PUT";
    EXPECT_EQ(send("GET /api/v1/session HTTP/1.1\r\nHost: localhost\r\n\r\n").status, 401);
}

TEST_F(RouteTest, TheDocumentListsExactlyTheRoutes) {
    std::string expected;
    for (const Route& route : routes()) expected += row_of(route);
    std::ifstream file{std::string{QDUINO_SOURCE_DIR} + "/docs/api.md"};
    const std::string text{std::istreambuf_iterator<char>{file}, {}};
    const std::size_t section = text.find("## All routes\n");
    ASSERT_NE(section, std::string::npos);
    const std::size_t rule = text.find("|---|---|---|---|\n", section);
    ASSERT_NE(rule, std::string::npos);
    const std::size_t begin = text.find('\n', rule) + 1;
    EXPECT_EQ(text.substr(begin, text.find("\n\n", begin) + 1 - begin), expected);
}

}  // namespace
}  // namespace qduino::web::route_test
