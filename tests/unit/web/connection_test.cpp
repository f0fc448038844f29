// A connection as a state machine: order of answers, 100-continue, back pressure, deadlines, bodies
// cut short.
#include <gmock/gmock.h>

#include <sstream>

#include "tests/unit/web/web_fixture.h"

namespace qduino::web::connection_test {
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
    /// One output, sent; empty when there is none.
    std::string send_one() {
        const auto next = connection_->take_output();
        if (!next) return {};
        EXPECT_FALSE(connection_->take_output()) << "one answer at a time";
        connection_->sent(moment());
        return next->bytes + next->body;
    }
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

TEST_F(ConnectionTest, TheNextRequestIsLookedAtWhenTheAnswerIsSent) {
    connect();
    std::string many;
    for (int i = 0; i < 1000; ++i) many += get("/healthz");
    receive(many.substr(0, Connection::kHeadReadMax));
    EXPECT_FALSE(connection_->wants_input());
    EXPECT_EQ(connection_->input_max(), 0u);
    EXPECT_LT(connection_->held_bytes(), Connection::kHeadReadMax + 2048) << "one answer, and what was read";
    EXPECT_EQ(service_->metrics().text(*spool_).find("qduino_http_requests_total{status=\"2xx\"} 1\n") !=
                  std::string::npos,
              true);
    int answers = 0;
    while (!send_one().empty()) ++answers;
    EXPECT_EQ(answers, static_cast<int>(Connection::kHeadReadMax / get("/healthz").size()));
    EXPECT_TRUE(connection_->wants_input()) << "all were answered but the one that was cut off";
    EXPECT_FALSE(connection_->is_idle());
}

TEST_F(ConnectionTest, AnAnswerThatNobodyTakesIsGivenUp) {
    connect();
    receive(get("/healthz"));
    ASSERT_TRUE(connection_->take_output());
    wait(std::chrono::seconds{59});
    EXPECT_FALSE(connection_->is_stalled());
    wait(std::chrono::seconds{2});
    EXPECT_TRUE(connection_->is_stalled());
}

TEST_F(ConnectionTest, AnAnswerThatIsTakenByTheByteIsGivenUp) {
    connect();
    receive(get("/healthz"));
    ASSERT_TRUE(connection_->take_output());
    for (int second = 0; second < 60; ++second) {
        wait(std::chrono::seconds{1});
        connection_->sent_some(100, moment());
        ASSERT_FALSE(connection_->is_stalled()) << second;
    }
    wait(std::chrono::seconds{1});
    EXPECT_TRUE(connection_->is_stalled());
}

TEST_F(ConnectionTest, ALongAnswerMayTakeItsTime) {
    connect();
    receive(get("/healthz"));
    ASSERT_TRUE(connection_->take_output());
    for (int second = 0; second < 600; ++second) {
        wait(std::chrono::seconds{1});
        connection_->sent_some(2000, moment());
    }
    EXPECT_FALSE(connection_->is_stalled());
}

TEST_F(ConnectionTest, WhoHasShownTheKeyIsKnownUntilHeShowsAWrongOne) {
    const auto send = [this](const std::string& request) {
        receive(request);
        static_cast<void>(output());
        return connection_->is_known();
    };
    connect();
    EXPECT_FALSE(send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"));
    EXPECT_TRUE(send(get("/api/version")));
    EXPECT_TRUE(send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"))
        << "what needs no proof changes nothing";
    EXPECT_FALSE(send("GET /api/version HTTP/1.1\r\nHost: localhost\r\nX-Api-Key: wrong\r\n\r\n"));
    const auto login = [](const std::string& key) {
        const std::string body = R"({"key":")" + key + "\"}";
        return "POST /api/v1/session HTTP/1.1\r\nHost: localhost\r\nContent-Length: " +
               std::to_string(body.size()) + "\r\n\r\n" + body;
    };
    EXPECT_FALSE(send(login("wrong")));
    EXPECT_TRUE(send(login(kKey)));
    EXPECT_FALSE(send(login("wrong")));
    receive(put(100) + "G");
    EXPECT_TRUE(connection_->is_known()) << "from the head on: an upload is not taken for a stranger's";
}

TEST_F(ConnectionTest, ALoginsBodyIsAsUrgentAsAHead) {
    connect();
    receive("POST /api/v1/session HTTP/1.1\r\nHost: localhost\r\nContent-Length: 4000\r\n\r\n");
    for (int i = 0; i < 14; ++i) {
        wait(std::chrono::seconds{1});
        receive(std::string(200, ' '));
        ASSERT_FALSE(connection_->wants_close()) << i;
    }
    wait(std::chrono::seconds{2});
    EXPECT_THAT(output(), HasSubstr("408"));
}

TEST_F(ConnectionTest, AChunkWhoseLineNeverEndsIsRefusedAndNotKept) {
    connect();
    receive("POST /api/v1/session HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n5;x=");
    for (int i = 0; i < 100 && connection_->input_max() > 0; ++i) {
        receive(std::string(4096, 'x'));
        ASSERT_LT(connection_->held_bytes(), 64u * 1024);
    }
    EXPECT_THAT(output(), HasSubstr("431"));
    EXPECT_TRUE(connection_->wants_close());
}

TEST_F(ConnectionTest, AnUnknownTransferCodingIsAnsweredOnceAndEndsTheConnection) {
    connect();
    const std::string second = get("/healthz");
    receive("POST /api/v1/session HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: gzip, chunked\r\n\r\n" +
            second);
    const std::string answered = output();
    EXPECT_EQ(parse(answered).status, 501);
    EXPECT_EQ(answered.find("HTTP/1.1", 1), std::string::npos) << "its body is no request";
    EXPECT_EQ(parse(answered).header("Connection"), "close");
    EXPECT_TRUE(connection_->wants_close());
    receive(second);
    EXPECT_EQ(output(), "");
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

TEST_F(ConnectionTest, ABadLineIsAnsweredWhileTheFileIsStillBeingSent) {
    connect();
    receive(put(1'000'000) + "G28\nG1 X10\nbad\nG1");
    const Answer answer = parse(output());
    EXPECT_EQ(answer.status, 422);
    EXPECT_EQ(answer.json()["error"]["line"], 3);
    EXPECT_EQ(answer.header("Connection"), "close");
    EXPECT_TRUE(connection_->wants_close()) << "the sending side is shut behind the answer";
    EXPECT_TRUE(connection_->wants_input()) << "and what is still sent is thrown away";
    EXPECT_EQ(files_in("incoming"), 0u);
    EXPECT_EQ(spool_->counts().total(), 0u);
    receive(std::string(10'000, 'x'));
    EXPECT_EQ(output(), "") << "one answer";
}

TEST_F(ConnectionTest, ABadLineInAFormIsAnsweredWhileItIsStillBeingSent) {
    const std::string form = multipart("a.gcode", "G28\nbad\nG1 X1\n");
    const std::string begin = form.substr(0, form.find("bad\n") + 3);
    connect();
    receive(std::string{"POST /api/files/local HTTP/1.1\r\nHost: localhost\r\nX-Api-Key: "} + kKey + "\r\n" +
            kMultipart + "Transfer-Encoding: chunked\r\n\r\n" + [&] {
                std::ostringstream chunk;
                chunk << std::hex << begin.size() << "\r\n" << begin << "\r\n";
                return chunk.str();
            }());
    EXPECT_EQ(output(), "") << "the line has no end yet: it could be another word";
    receive("1\r\n\n\r\n");
    // The reader of a form holds back what may be the beginning of its end.
    receive("40\r\n" + std::string(64, '-') + "\r\n");
    const Answer answer = parse(output());
    EXPECT_EQ(answer.status, 422);
    EXPECT_EQ(answer.json()["error"]["line"], 2);
    EXPECT_TRUE(connection_->wants_close());
    EXPECT_EQ(files_in("incoming"), 0u);
}

TEST_F(ConnectionTest, WhoHasShownTheKeyMaySendALargeRefusedBodyToItsEnd) {
    connect();
    receive(put(1'000'000) + "not gcode\n");
    EXPECT_EQ(parse(output()).status, 415);
    for (int second = 0; second < 58; ++second) {
        wait(std::chrono::seconds{1});
        receive(std::string(1000, 'x'));
        ASSERT_FALSE(connection_->is_closed()) << second;
    }
    wait(std::chrono::seconds{3});
    EXPECT_TRUE(connection_->is_closed()) << "not for ever";

    connect();
    receive(put(1'000'000) + "not gcode\n");
    static_cast<void>(output());
    wait(std::chrono::seconds{6});
    EXPECT_TRUE(connection_->is_closed()) << "it sends nothing more";
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
    api::Context context{*spool_, {}, "{}", "1", {}};
    const auto at_once = [](Task task) { task(); };
    service_ = std::make_unique<Service>(
        ServiceOptions{HostPolicy{{}}, 4}, std::move(context), Authenticator{kKey, {}, random_token},
        StaticFiles{}, analyzer_,
        Executors{at_once, at_once, [&](Task task) { held.push_back(std::move(task)); }, at_once});
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
    receive(get("/api/v1/live", "Connection: Upgrade\r\nUpgrade: websocket\r\n") + "a frame");
    EXPECT_TRUE(connection_->is_live());
    EXPECT_EQ(connection_->take_rest(), "a frame") << "the stream's owner reads on from here";
    connect();
    receive(get("/api/v1/live"));
    EXPECT_EQ(parse(output()).status, 400);
}

}  // namespace
}  // namespace qduino::web::connection_test
