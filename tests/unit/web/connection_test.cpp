// A connection as a state machine: order of answers, 100-continue, back pressure, deadlines, bodies cut short.
#include <gmock/gmock.h>

#include "tests/unit/web/web_fixture.h"

namespace qduino::web {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class ConnectionTest : public WebTest {
  protected:
    std::string get(const std::string& path, const std::string& more = "") const {
        return "GET " + path + " HTTP/1.1\r\nHost: localhost\r\nX-Api-Key: " + kKey + "\r\n" + more + "\r\n";
    }
    std::string put(std::size_t length, const std::string& more = "") const {
        return std::string{"PUT /api/v1/jobs/a.gcode HTTP/1.1\r\nHost: localhost\r\nX-Api-Key: "} + kKey +
               "\r\n" + more + "Content-Length: " + std::to_string(length) + "\r\n\r\n";
    }
    void receive(const std::string& text) { connection_->receive(text, moment()); }
    void wait(Nanoseconds time) {
        now_ += time;
        connection_->check_time(moment());
    }
};

TEST_F(ConnectionTest, AnswersRequestAfterRequest) {
    connect();
    receive(get("/healthz") + get("/api/version") + get("/nothing"));
    const std::string out = output();
    EXPECT_THAT(out, HasSubstr("ok\n"));
    EXPECT_LT(out.find("ok\n"), out.find("OctoPrint"));
    EXPECT_LT(out.find("OctoPrint"), out.find("404 Not Found"));
    EXPECT_FALSE(connection_->wants_close());
    EXPECT_TRUE(connection_->is_idle());
}

TEST_F(ConnectionTest, ByteByByteIsTheSame) {
    connect();
    for (const char c : get("/healthz")) receive(std::string(1, c));
    EXPECT_EQ(parse(output()).body, "ok\n");
}

TEST_F(ConnectionTest, ClosesWhenAsked) {
    connect();
    receive(get("/healthz", "Connection: close\r\n"));
    EXPECT_EQ(parse(output()).header("Connection"), "close");
    EXPECT_TRUE(connection_->is_closed());
}

TEST_F(ConnectionTest, AnswersExpectContinueBeforeTheBody) {
    connect();
    receive(put(5, "Expect: 100-continue\r\n"));
    EXPECT_EQ(output(), "HTTP/1.1 100 Continue\r\n\r\n");
    receive("G28\n\n");
    EXPECT_EQ(parse(output()).status, 201);
}

TEST_F(ConnectionTest, ARefusalComesInsteadOfContinue) {
    connect();
    receive(
        "PUT /api/v1/jobs/a.gcode HTTP/1.1\r\nHost: localhost\r\nExpect: 100-continue\r\nContent-Length: "
        "5\r\n\r\n");
    EXPECT_THAT(output(), StartsWith("HTTP/1.1 401"));
    EXPECT_TRUE(connection_->wants_close());
}

TEST_F(ConnectionTest, HeadHasTheLengthAndNoBody) {
    connect();
    receive("HEAD /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
    const Answer answer = parse(output());
    EXPECT_EQ(answer.header("Content-Length"), "3");
    EXPECT_EQ(answer.body, "");
}

TEST_F(ConnectionTest, ABodyCutShortQueuesNothingAndLeavesNoFile) {
    connect();
    receive(put(100) + "G28\n");
    EXPECT_EQ(files_in("incoming"), 1u);
    connection_->receive_end();
    EXPECT_THAT(output(), HasSubstr("400 Bad Request"));
    EXPECT_TRUE(connection_->is_closed());
    EXPECT_EQ(files_in("incoming"), 0u);
    EXPECT_EQ(spool_->queue().size(), 0u);
}

TEST_F(ConnectionTest, ARefusedBodyIsDrainedForAWhileAndNoLonger) {
    connect();
    receive("POST /api/v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n\r\nabc");
    EXPECT_THAT(output(), HasSubstr("401"));
    EXPECT_TRUE(connection_->wants_close());
    EXPECT_FALSE(connection_->is_closed());
    EXPECT_TRUE(connection_->wants_input());
    receive(std::string(500, 'x'));
    EXPECT_EQ(output(), "");
    wait(std::chrono::seconds{6});
    EXPECT_TRUE(connection_->is_closed());
}

TEST_F(ConnectionTest, ASlowHeadIsDropped) {
    connect();
    receive("GET / HT");
    for (int i = 0; i < 14; ++i) {
        wait(std::chrono::seconds{1});
        receive("T");
        ASSERT_FALSE(connection_->wants_close()) << i;
    }
    wait(std::chrono::seconds{2});
    EXPECT_THAT(output(), HasSubstr("408"));
    EXPECT_TRUE(connection_->wants_close());
}

TEST_F(ConnectionTest, AnIdleConnectionIsClosedInSilence) {
    connect();
    receive(get("/healthz"));
    static_cast<void>(output());
    wait(std::chrono::seconds{74});
    EXPECT_FALSE(connection_->wants_close());
    wait(std::chrono::seconds{2});
    EXPECT_TRUE(connection_->is_closed());
    EXPECT_EQ(output(), "");
}

TEST_F(ConnectionTest, ABodyThatTricklesIsDropped) {
    connect();
    receive(put(100'000));
    for (int second = 0; second < 61; ++second) {
        wait(std::chrono::seconds{1});
        receive("x");
    }
    wait(std::chrono::seconds{1});
    EXPECT_THAT(output(), HasSubstr("408"));
    EXPECT_EQ(files_in("incoming"), 0u);
}

TEST_F(ConnectionTest, ABodyThatStopsIsDropped) {
    connect();
    receive(put(100'000) + std::string(50'000, 'x'));
    wait(std::chrono::seconds{31});
    EXPECT_THAT(output(), HasSubstr("408"));
}

TEST_F(ConnectionTest, WhileAPieceIsWithTheDiskNothingMoreIsRead) {
    std::vector<Task> held;
    api::Context context{*spool_, {}, "", "{}", "1", {}};
    const auto at_once = [](Task task) { task(); };
    service_ = std::make_unique<Service>(
        ServiceOptions{HostPolicy{{}}, 4}, std::move(context), Authenticator{kKey, {}}, StaticFiles{},
        analyzer_, Executors{at_once, at_once, [&](Task task) { held.push_back(std::move(task)); }, at_once});
    connect();
    receive(put(8));
    EXPECT_TRUE(connection_->wants_input());
    receive("G28\n");
    EXPECT_FALSE(connection_->wants_input());
    ASSERT_EQ(held.size(), 1u);
    wait(std::chrono::seconds{300});
    EXPECT_FALSE(connection_->wants_close()) << "the disk's time is not the peer's";
    std::exchange(held, {})[0]();
    EXPECT_TRUE(connection_->wants_input());
    receive("G29\n");
    std::exchange(held, {})[0]();
    ASSERT_EQ(held.size(), 1u) << "the end of the upload";
    std::exchange(held, {})[0]();
    EXPECT_EQ(parse(output()).status, 201);
    connection_.reset();
}

TEST_F(ConnectionTest, TooManyUploadsAtOnceAreAskedToComeBack) {
    std::vector<std::shared_ptr<Connection>> open;
    for (int i = 0; i < 4; ++i) {
        connect();
        receive(put(100) + "G");
        open.push_back(connection_);
    }
    connect();
    receive(put(100));
    const Answer answer = parse(output());
    EXPECT_EQ(answer.status, 503);
    EXPECT_EQ(answer.header("Retry-After"), "5");
    open.pop_back();
    connect();
    receive(put(4) + "G28\n");
    EXPECT_EQ(parse(output()).status, 201);
}

TEST_F(ConnectionTest, GarbageIsAnsweredAndClosed) {
    connect();
    receive("\x16\x03\x01 this is no HTTP\r\n\r\n");
    EXPECT_THAT(output(), StartsWith("HTTP/1.1 400"));
    EXPECT_TRUE(connection_->wants_close());
}

TEST_F(ConnectionTest, ALiveStreamIsHandedToTheSocketsOwner) {
    connect();
    receive(get("/api/v1/live", "Connection: Upgrade\r\nUpgrade: websocket\r\n"));
    EXPECT_TRUE(connection_->is_live());
    connect();
    receive(get("/api/v1/live"));
    EXPECT_EQ(parse(output()).status, 400);
}

}  // namespace
}  // namespace qduino::web
