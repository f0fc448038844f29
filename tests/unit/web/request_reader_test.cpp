// Requests from bytes: the same result in any pieces; an ambiguous or too large request is refused.
#include "web/http/request_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace qduino::web::request_reader_test {
namespace {

struct Read {
    std::vector<RequestHead> heads;
    std::vector<std::string> bodies;
    std::optional<Error> error;
};

/// Feeds `text` in pieces of `piece` bytes.
Read read(std::string_view text, std::size_t piece = 1 << 20, ReadLimits limits = {}) {
    Read result;
    RequestReader reader{limits};
    while (!text.empty()) {
        const std::size_t count = std::min(piece, text.size());
        reader.feed({text.data(), count});
        text.remove_prefix(count);
        while (true) {
            std::string body;
            const auto progress = reader.advance(body);
            if (!progress.ok()) {
                result.error = progress.error();
                return result;
            }
            if (*progress == RequestReader::Progress::need_more) break;
            if (*progress == RequestReader::Progress::head) {
                result.heads.push_back(reader.head());
                result.bodies.emplace_back();
            }
            if (*progress == RequestReader::Progress::body) result.bodies.back() += body;
            if (*progress == RequestReader::Progress::complete) reader.next();
        }
    }
    return result;
}

constexpr std::string_view kPost = "POST /a/b?c HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\n\r\nhello";
constexpr std::string_view kChunked =
    "PUT /f HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n6;ext=1\r\n "
    "world\r\n0\r\nTrailer: t\r\n\r\n";

TEST(RequestReader, ReadsBodiesByLengthAndByChunk) {
    const Read post = read(kPost);
    ASSERT_EQ(post.heads.size(), 1u);
    EXPECT_EQ(post.heads[0].method, Method::post);
    EXPECT_EQ(post.heads[0].content_length, 5u);
    EXPECT_EQ(post.bodies[0], "hello");
    const Read chunked = read(kChunked);
    ASSERT_EQ(chunked.heads.size(), 1u);
    EXPECT_TRUE(chunked.heads[0].chunked);
    EXPECT_EQ(chunked.bodies[0], "hello world");
    EXPECT_EQ(chunked.heads[0].find("Trailer"), nullptr);
}

TEST(RequestReader, PiecesOfAnySizeAndPipeliningChangeNothing) {
    const std::string text =
        std::string{kPost} + std::string{kChunked} + "GET / HTTP/1.1\r\nHost: y\r\n\r\n" + std::string{kPost};
    for (std::size_t piece = 1; piece <= text.size(); ++piece) {
        const Read result = read(text, piece);
        ASSERT_FALSE(result.error) << piece;
        ASSERT_EQ(result.heads.size(), 4u) << piece;
        EXPECT_THAT(result.bodies, ::testing::ElementsAre("hello", "hello world", "", "hello")) << piece;
    }
}

TEST(RequestReader, SeesWhatAConnectionNeeds) {
    const Read expect =
        read("PUT / HTTP/1.1\r\nHost: x\r\nExpect: 100-Continue\r\nContent-Length: 1\r\n\r\n");
    EXPECT_TRUE(expect.heads.at(0).expects_continue);
    EXPECT_TRUE(expect.heads.at(0).keep_alive);
    const Read close = read("GET / HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
    EXPECT_FALSE(close.heads.at(0).keep_alive);
    const Read upgrade =
        read("GET / HTTP/1.1\r\nHost: x\r\nConnection: keep-alive, Upgrade\r\nUpgrade: websocket\r\n\r\n");
    EXPECT_TRUE(upgrade.heads.at(0).upgrades_to_websocket);
}

TEST(RequestReader, RefusesWhatIsAmbiguousOrMalformed) {
    for (const char* bad : {
             // No Host.
             "GET / HTTP/1.1\r\n\r\n",
             "GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",  // two
             "GET / HTTP/1.0\r\nHost: a\r\nHost: b\r\n\r\n",
             // which?
             "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\nContent-Length: 6\r\n\r\n",
             "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n",
             "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: -1\r\n\r\n",
             "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 99999999999999999999999\r\n\r\n",
             "GET http://a/ HTTP/1.1\r\nHost: a\r\n\r\n", "GET / HTTP/2.0\r\nHost: a\r\n\r\n",
             "GET  / HTTP/1.1\r\nHost: a\r\n\r\n", "GET /\x01 HTTP/1.1\r\nHost: a\r\n\r\n",
             "GET / HTTP/1.1\r\nHost : a\r\n\r\n", "GET / HTTP/1.1\r\n Host: a\r\n\r\n",
             "\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",  // TLS on a plain port
         }) {
        EXPECT_TRUE(read(bad).error.has_value()) << bad;
    }
}

TEST(RequestReader, Http10NeedsNoHost) {
    const Read old = read("GET /healthz HTTP/1.0\r\n\r\n");
    ASSERT_FALSE(old.error.has_value()) << old.error->message.view();
    EXPECT_FALSE(old.heads.at(0).keep_alive);
    EXPECT_EQ(old.heads.at(0).find("Host"), nullptr);
}

/// A client that sends a file's name as it is must learn what to do, not that it speaks no HTTP.
TEST(RequestReader, APercentThatEncodesNothingIsSaid) {
    for (const char* name : {"100%.gcode", "a%b.gcode", "a%zz.gcode"}) {
        const Read found = read("PUT /api/v1/jobs/" + std::string{name} +
                                " HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\n\r\n");
        ASSERT_TRUE(found.error.has_value()) << name;
        EXPECT_THAT(std::string{found.error->message.view()},
                    ::testing::HasSubstr("% in a file's name is sent as %25"));
    }
}

/// Each of these bodies would be read as a second request where the coding was overlooked.
TEST(RequestReader, ACodingThatIsNotExactlyChunkedIsNotUnderstoodAndItsBodyIsNoRequest) {
    const std::string hidden = "GET /hidden HTTP/1.1\r\nHost: x\r\n\r\n";
    for (const char* fields : {
             "Transfer-Encoding: gzip\r\n",
             "Transfer-Encoding: identity\r\n",
             "Transfer-Encoding: gzip, chunked\r\n",
             "Transfer-Encoding: chunked, gzip\r\n",
             "Transfer-Encoding: chunked, chunked\r\n",
             "Transfer-Encoding: chunked;q=1\r\n",
             "Transfer-Encoding: xchunked\r\n",
             "Transfer-Encoding: \"chunked\"\r\n",
             "Transfer-Encoding: \r\n",
             "Transfer-Encoding: ,chunked\r\n",
             "Transfer-Encoding: gzip\r\nTransfer-Encoding: chunked\r\n",
         }) {
        for (const std::string& body : {hidden, "0\r\n\r\n" + hidden}) {
            const Read found = read("POST / HTTP/1.1\r\nHost: x\r\n" + std::string{fields} + "\r\n" + body);
            ASSERT_TRUE(found.error.has_value()) << fields;
            EXPECT_EQ(found.error->code, ErrorCode::unsupported) << fields;
            EXPECT_TRUE(found.heads.empty()) << fields;
        }
    }
    for (const char* plain : {"Transfer-Encoding: Chunked\r\n", "transfer-encoding:\tchunked \r\n"}) {
        const Read found = read("POST / HTTP/1.1\r\nHost: x\r\n" + std::string{plain} +
                                "\r\n5\r\nhello\r\n0\r\n\r\n" + hidden);
        ASSERT_FALSE(found.error.has_value()) << plain;
        ASSERT_EQ(found.heads.size(), 2u) << plain;
        EXPECT_EQ(found.bodies[0], "hello") << plain;
    }
}

TEST(RequestReader, ACodingBesideALengthOrInOldHttpIsMalformed) {
    for (const char* bad : {
             "POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 4\r\nTransfer-Encoding: chunked\r\n\r\n",
             "POST / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\nContent-Length: 4\r\n\r\n",
             "POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 4\r\nTransfer-Encoding: gzip\r\n\r\n",
             "POST / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: gzip\r\nContent-Length: 4\r\n\r\n",
             "POST / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\nTransfer-Encoding: "
             "identity\r\n\r\n",
             "POST / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n\r\n",
             "POST / HTTP/1.0\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
             "POST / HTTP/1.0\r\nHost: x\r\nTransfer-Encoding: gzip\r\n\r\n",
         }) {
        const Read found = read(bad);
        ASSERT_TRUE(found.error.has_value()) << bad;
        EXPECT_EQ(found.error->code, ErrorCode::invalid_argument) << bad;
    }
}

TEST(RequestReader, BoundsTheHeader) {
    EXPECT_EQ(read("GET /" + std::string(20'000, 'a') + " HTTP/1.1\r\nHost: x\r\n\r\n").error->code,
              ErrorCode::out_of_range);
    std::string many = "GET / HTTP/1.1\r\nHost: x\r\n";
    for (int i = 0; i < 200; ++i) many += "A: b\r\n";
    EXPECT_EQ(read(many + "\r\n").error->code, ErrorCode::out_of_range);
    EXPECT_TRUE(read("GET /" + std::string(20'000, 'a'), 100).error.has_value()) << "also when it never ends";
}

TEST(RequestReader, BoundsWhatStandsAroundChunks) {
    const std::string head = "PUT /f HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n";
    for (const char* begun : {"5;extension=", "5\r\nhello\r\n0\r\nTrailer: ", "0\r\nA: b\r\nB: "}) {
        const Read endless = read(head + begun + std::string(100'000, 'x'), 1000);
        ASSERT_TRUE(endless.error.has_value()) << begun;
        EXPECT_EQ(endless.error->code, ErrorCode::out_of_range) << begun;
    }
    EXPECT_FALSE(read(head + "5;extension=" + std::string(8000, 'x') + "\r\nhello\r\n0\r\n\r\n", 1000).error);
}

TEST(RequestReader, HoldsNothingWhileItWaits) {
    RequestReader reader;
    std::string body;
    reader.feed(kPost);
    while (*reader.advance(body) != RequestReader::Progress::complete) {
    }
    reader.next();
    EXPECT_EQ(reader.held_bytes(), 0u);
    EXPECT_TRUE(reader.idle());
}

TEST(RequestReader, HandsOnWhatItHasNotUsed) {
    RequestReader reader;
    std::string body;
    reader.feed(std::string_view{"GET / HTTP/1.1\r\nHost: x\r\n\r\nrest"});
    ASSERT_EQ(*reader.advance(body), RequestReader::Progress::head);
    EXPECT_EQ(*reader.advance(body), RequestReader::Progress::complete);
    EXPECT_EQ(reader.take_rest(), "rest");
}

}  // namespace
}  // namespace qduino::web::request_reader_test
