#include "web/http/http.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace qduino::web::http_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(Target, IsSplitBeforeItIsDecoded) {
    RequestHead head;
    ASSERT_TRUE(parse_target("/api/v1/jobs/a%2Fb%20c.gcode?x=1&y=%C3%BC", head));
    EXPECT_THAT(head.path, ElementsAre("api", "v1", "jobs", "a/b c.gcode"));
    EXPECT_EQ(head.query_value("x"), "1");
    EXPECT_EQ(head.query_value("y"), "ü");
    EXPECT_EQ(head.query_value("z"), "");
}

TEST(Target, TheRootIsOneEmptySegment) {
    RequestHead head;
    ASSERT_TRUE(parse_target("/", head));
    EXPECT_THAT(head.path, ElementsAre(""));
    ASSERT_TRUE(parse_target("/?a", head));
    EXPECT_THAT(head.path, ElementsAre(""));
}

TEST(Target, RefusesWhatIsNoAbsolutePath) {
    RequestHead head;
    for (const char* bad : {"", "*", "jobs", "http://a/b", "/%", "/%4", "/%zz", "/%00", "/a%"}) {
        EXPECT_FALSE(parse_target(bad, head)) << bad;
    }
    EXPECT_FALSE(parse_target(std::string(100, '/'), head)) << "too many segments";
}

TEST(Headers, AreFoundInAnyCase) {
    RequestHead head;
    head.headers = {{"X-Api-Key", "k"}};
    EXPECT_EQ(head.value("x-api-key"), "k");
    EXPECT_EQ(head.find("x-api"), nullptr);
}

TEST(Response, CarriesTheSecurityHeadersAlways) {
    const std::string head = head_bytes(Response{}, true);
    EXPECT_THAT(head, HasSubstr("X-Content-Type-Options: nosniff\r\n"));
    EXPECT_THAT(head, HasSubstr("Content-Security-Policy: default-src 'self'; script-src 'self';"));
    EXPECT_THAT(head, HasSubstr("frame-ancestors 'none'"));
    EXPECT_THAT(head, HasSubstr("Cache-Control: no-store\r\n"));
    EXPECT_THAT(head, HasSubstr("Referrer-Policy: no-referrer\r\n"));
}

TEST(Response, WithoutContentHasNoLength) {
    Response response;
    response.status = 204;
    EXPECT_EQ(head_bytes(response, true).find("Content-Length"), std::string::npos);
    response.status = 200;
    response.file = FileRange{nullptr, 5, 123};
    EXPECT_THAT(head_bytes(response, false), HasSubstr("Content-Length: 123\r\n"));
    EXPECT_THAT(head_bytes(response, false), HasSubstr("Connection: close\r\n"));
}

TEST(ErrorResponse, IsJsonWhateverTheMessage) {
    EXPECT_EQ(error_response(400, "invalid_argument", "say \"please\"\n").body,
              R"({"error":{"code":"invalid_argument","message":"say \"please\" "}})");
}

}  // namespace
}  // namespace qduino::web::http_test
