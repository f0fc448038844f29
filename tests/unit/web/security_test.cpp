// The classes of vulnerability that peers had, one test each. The numbers are the CVEs in which
// each class was found.
#include <gmock/gmock.h>

#include "tests/unit/web/web_fixture.h"

namespace qduino::web::security_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class SecurityTest : public WebTest {
  protected:
    /// A browser's login; the cookie's name and value.
    std::string log_in() {
        const std::string body = std::string{R"({"key":")"} + kKey + "\"}";
        const Answer answer = send("POST /api/v1/session HTTP/1.1\r\nHost: localhost\r\nContent-Length: " +
                                   std::to_string(body.size()) + "\r\n\r\n" + body);
        EXPECT_EQ(answer.status, 204);
        const std::string cookie = answer.header("Set-Cookie");
        EXPECT_THAT(cookie, HasSubstr("HttpOnly"));
        EXPECT_THAT(cookie, HasSubstr("SameSite=Strict"));
        EXPECT_THAT(cookie, HasSubstr("Max-Age=43200"));
        return cookie.substr(0, cookie.find(';'));
    }
    Answer with_cookie(const std::string& line, const std::string& cookie, const std::string& headers = "") {
        return send(line + " HTTP/1.1\r\nHost: localhost:8080\r\nCookie: " + cookie + "\r\n" + headers +
                    "\r\n");
    }
    static const std::vector<std::string>& guarded() {
        static const std::vector<std::string> paths{"GET /api/v1/jobs",
                                                    "GET /api/v1/jobs/1",
                                                    "GET /api/v1/jobs/1/file",
                                                    "DELETE /api/v1/jobs/1",
                                                    "PATCH /api/v1/jobs/1",
                                                    "POST /api/v1/jobs",
                                                    "PUT /api/v1/jobs/a",
                                                    "POST /api/v1/jobs/1/start",
                                                    "GET /api/v1/machine",
                                                    "POST /api/v1/machine/pause",
                                                    "POST /api/v1/machine/emergency-stop",
                                                    "POST /api/v1/machine/gcode",
                                                    "GET /api/v1/config",
                                                    "GET /api/v1/guarantee",
                                                    "GET /metrics",
                                                    "POST /api/v1/live-ticket",
                                                    "GET /api/version",
                                                    "POST /api/files/local",
                                                    "GET /api/printer",
                                                    "POST /api/login",
                                                    "GET /api/v1/info",
                                                    "PUT /api/v1/files/local/a",
                                                    "DELETE /api/v1/session",
                                                    "POST /api/v1/queue/release",
                                                    "GET /api/anything",
                                                    "DELETE /api/v1/job/1"};
        return paths;
    }
};

TEST_F(SecurityTest, NothingIsPossibleWithoutTheKey) {
    static_cast<void>(upload("a.gcode", "G28\n"));
    for (const std::string& line : guarded()) {
        const Answer none = send(line + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
        EXPECT_EQ(none.status, 401) << line;
        EXPECT_EQ(none.error_code(), "not_permitted") << line;
    }
    EXPECT_EQ(send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n").body, "ok\n");
    EXPECT_EQ(spool_->queue().size(), 1u);
}

TEST_F(SecurityTest, FormFieldsNeverNameAFile_CVE_2025_48067_2026_54134) {
    for (const auto& [field, value] : std::map<std::string, std::string>{{"file.path", "/etc/passwd"},
                                                                         {"file.name", "x"},
                                                                         {"path", "../../etc"},
                                                                         {"path", "/etc"},
                                                                         {"root", "config"}}) {
        const Answer answer = upload("a.gcode", "G28\n", {{field, value}});
        if (answer.status == 201) {
            EXPECT_EQ(
                request("GET /api/v1/jobs/" + std::to_string(answer.json()["id"].get<int>()) + "/file").body,
                "G28\n");
        } else {
            EXPECT_EQ(answer.status, 400);
        }
    }
    // A part named `file` that is a field and no file brings no bytes.
    const std::string body =
        "--XX\r\nContent-Disposition: form-data; name=\"file\"\r\n\r\n/etc/passwd\r\n--XX--\r\n";
    EXPECT_EQ(request("POST /api/v1/jobs", body, kMultipart).status, 400);
    EXPECT_TRUE(std::filesystem::exists("/etc/passwd"));
}

TEST_F(SecurityTest, NamesAreTextForPeopleAndNeverReachAShellOrAPath_CVE_2025_58180) {
    const std::string name = "$(touch x);`id`|&&.gcode";
    ASSERT_EQ(upload(name, "G28\n").status, 201);
    EXPECT_EQ(spool_->queue().find(1)->name, name);
    EXPECT_TRUE(std::filesystem::exists(blobs().path(spool::sha256_of("G28\n"), spool::BlobPart::gcode)));
    EXPECT_EQ(request("GET /api/v1/jobs/1/file").header("Content-Disposition"),
              "attachment; filename=\"__touch_x___id____.gcode\"");
}

TEST_F(SecurityTest, ThereIsNoMoveAndNoRenameThatCouldChangeAnExtension_CVE_2022_2872) {
    static_cast<void>(upload("a.gcode", "G28\n"));
    EXPECT_EQ(request("PATCH /api/v1/jobs/1", R"({"name":"a.html"})").status, 400);
    // Whatever its name, a job's file is served as bytes to be saved.
    static_cast<void>(upload("a.html", "G28\n<script>\n"));
    const Answer file = request("GET /api/v1/jobs/2/file");
    EXPECT_EQ(file.header("Content-Type"), "application/octet-stream");
    EXPECT_THAT(file.header("Content-Disposition"), HasSubstr("attachment"));
    EXPECT_EQ(file.header("X-Content-Type-Options"), "nosniff");
}

TEST_F(SecurityTest, PathsInNamesAreRefused_CVE_2023_31059) {
    for (const char* name :
         {"../a.gcode", "..\\..\\a.gcode", "/etc/cron.d/a", "a/b.gcode", "C:\\a.gcode", "..", "."}) {
        EXPECT_EQ(upload(name, "G28\n").status, 400) << name;
    }
    for (const char* target :
         {"..%2fa.gcode", "%2e%2e%5ca.gcode", "x/../../a.gcode", "a%2F..%2Fb", "%2e%2e", "a%00b"}) {
        EXPECT_EQ(request(std::string{"PUT /api/v1/jobs/"} + target, "G28\n").status, 400) << target;
        EXPECT_EQ(request(std::string{"PUT /api/v1/files/local/"} + target, "G28\n").status, 400) << target;
    }
    EXPECT_EQ(spool_->queue().size(), 0u);
    EXPECT_EQ(request("GET /api/v1/jobs/..%2f..%2fapi-key/file").status, 404);
    // A folder is no path: it becomes words of the name.
    ASSERT_EQ(request("PUT /api/v1/jobs/a%2Fb", "G28\n").status, 201);
    EXPECT_EQ(spool_->queue().find(1)->name, "a - b");
}

TEST_F(SecurityTest, MultipartWithoutEndBoundaryEnds_CVE_2025_48879) {
    const std::string body =
        "--XX\r\nContent-Disposition: form-data; name=\"file\"; filename=\"a\"\r\n\r\nG28\n";
    const Answer answer = request("POST /api/v1/jobs", body, kMultipart);
    EXPECT_EQ(answer.status, 400);
    EXPECT_THAT(answer.body, HasSubstr("end boundary"));
    EXPECT_EQ(files_in("incoming"), 0u);
    EXPECT_EQ(spool_->queue().size(), 0u);
}

TEST_F(SecurityTest, ForwardedHeadersProveNothing_CVE_2024_32977) {
    for (const char* header : {"X-Forwarded-For: 127.0.0.1", "Forwarded: for=127.0.0.1",
                               "X-Real-IP: 127.0.0.1", "X-Remote-User: admin"}) {
        EXPECT_EQ(send(std::string{"GET /api/v1/jobs HTTP/1.1\r\nHost: localhost\r\n"} + header + "\r\n\r\n")
                      .status,
                  401)
            << header;
    }
    // Nor do they hide who tries keys.
    int status = 0;
    for (int i = 0; i < 40; ++i) {
        status = send(
                     "GET /api/v1/jobs HTTP/1.1\r\nHost: localhost\r\nX-Api-Key: wrong\r\nX-Forwarded-For: "
                     "10.0.0." +
                     std::to_string(i) + "\r\n\r\n")
                     .status;
    }
    EXPECT_EQ(status, 429);
}

TEST_F(SecurityTest, NothingRedirects_CVE_2025_32788) {
    for (const char* target : {"/?redirect=//evil.example", "/login?redirect=https://evil.example",
                               "//evil.example", "/api/v1/session?next=//evil"}) {
        const Answer answer = send(std::string{"GET "} + target + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
        EXPECT_THAT(answer.status / 100, Not(3)) << target;
        EXPECT_EQ(answer.header("Location"), "") << target;
    }
}

TEST_F(SecurityTest, GuessingKeysIsLimited_CVE_2022_2822) {
    const std::string guess =
        "POST /api/v1/session HTTP/1.1\r\nHost: localhost\r\nContent-Length: 13\r\n\r\n{\"key\":\"abc\"}";
    int refused = 0, limited = 0;
    for (int i = 0; i < 50; ++i) {
        const Answer answer = send(guess, "10.0.0.9");
        refused += answer.status == 401 ? 1 : 0;
        limited += answer.status == 429 ? 1 : 0;
        if (answer.status == 429) {
            EXPECT_FALSE(answer.header("Retry-After").empty());
        }
    }
    EXPECT_EQ(refused, FailureLimiter::kBurst);
    EXPECT_EQ(limited, 50 - FailureLimiter::kBurst);
    EXPECT_EQ(send(guess, "10.0.0.8").status, 401) << "another address may still try";
}

TEST_F(SecurityTest, SessionsEnd_CVE_2022_2888) {
    const std::string cookie = log_in();
    EXPECT_EQ(with_cookie("GET /api/v1/jobs", cookie).status, 200);
    EXPECT_EQ(with_cookie("DELETE /api/v1/session", cookie, "Origin: http://localhost:8080\r\n").status, 204);
    EXPECT_EQ(with_cookie("GET /api/v1/jobs", cookie).status, 401);
    const std::string second = log_in();
    now_ += std::chrono::hours{12};
    EXPECT_EQ(with_cookie("GET /api/v1/jobs", second).status, 401);
}

TEST_F(SecurityTest, SessionsSurviveARestartAndSoDoTheirEnds) {
    const std::string kept = log_in(), ended = log_in();
    static_cast<void>(with_cookie("DELETE /api/v1/session", ended, "Origin: http://localhost:8080\r\n"));
    open_service();
    EXPECT_EQ(with_cookie("GET /api/v1/jobs", kept).status, 200);
    EXPECT_EQ(with_cookie("GET /api/v1/jobs", ended).status, 401);
}

TEST_F(SecurityTest, NoAnswerHoldsTheKey_CVE_2024_51493_2024_23637) {
    static_cast<void>(upload("a.gcode", "G28\n"));
    for (const std::string& line : guarded()) {
        const Answer answer = request(line);
        EXPECT_THAT(answer.head + answer.body, Not(HasSubstr(kKey))) << line;
    }
    for (const char* line : {"GET /api/settings", "GET /api/printerprofiles", "POST /api/login"}) {
        const Answer answer = request(line, R"({"passive":true})");
        EXPECT_THAT(answer.head + answer.body, Not(HasSubstr(kKey))) << line;
    }
}

TEST_F(SecurityTest, KeysAreComparedWholeWhateverTheirPrefix_CVE_2026_23892) {
    // That the time is constant is libsodium's promise; that every wrong key is wrong is ours.
    const std::string key = kKey;
    for (const std::string& wrong :
         {key.substr(0, 42), key + "A", std::string(43, '0'), std::string{}, key.substr(1)}) {
        EXPECT_EQ(
            send("GET /api/v1/jobs HTTP/1.1\r\nHost: localhost\r\nX-Api-Key: " + wrong + "\r\n\r\n").status,
            401);
    }
}

TEST_F(SecurityTest, ErrorsDoNotEchoInput_CVE_2021_32561) {
    const std::string evil = "<script>alert(1)</script>";
    const std::vector<Answer> answers{
        request("GET /api/v1/jobs/%3Cscript%3Ealert(1)%3C/script%3E"),
        request("GET /api/v1/" + std::string{"%3Cscript%3Ealert(1)%3C%2Fscript%3E"}),
        request("PATCH /api/v1/jobs/1", "{\"" + evil + "\":1}"),
        request("POST /api/v1/machine/jog", "{\"x_mm\":\"" + evil + "\"}"),
        request("PUT /api/v1/jobs/..%2F%3Cscript%3Ealert(1)%3C%2Fscript%3E", "G28\n"),
        upload("../" + evil, "G28\n"),
        upload("a", "G28\n", {{"copies", evil}}),
        request("GET /api/v1/jobs", "", "Origin: " + evil + "\r\n"),
        send("GET / HTTP/1.1\r\nHost: " + evil + "\r\n\r\n"),
        send(evil + " / HTTP/1.1\r\nHost: localhost\r\n\r\n"),
        send("GET / HTTP/1.1\r\nHost: localhost\r\n" + evil + "\r\n\r\n"),
    };
    for (std::size_t i = 0; i < answers.size(); ++i) {
        EXPECT_THAT(answers[i].head + answers[i].body, Not(HasSubstr("alert"))) << i;
        EXPECT_THAT(answers[i].header("Content-Type"), ::testing::AnyOf("application/json", "")) << i;
    }
}

TEST_F(SecurityTest, TextOfJobsAndMachineIsJsonThatNobodyRendersAsHtml_CVE_2025_64187_2026_35163) {
    ASSERT_EQ(upload("<img src=x onerror=alert(1)>.gcode", "G28\n").status, 201);
    const Answer jobs = request("GET /api/v1/jobs");
    EXPECT_EQ(jobs.header("Content-Type"), "application/json");
    EXPECT_EQ(jobs.header("X-Content-Type-Options"), "nosniff");
    EXPECT_THAT(jobs.header("Content-Security-Policy"), HasSubstr("script-src 'self'"));
    EXPECT_EQ(jobs.json()["jobs"][0]["name"], "<img src=x onerror=alert(1)>.gcode");
}

TEST_F(SecurityTest, NoTemplatesNoExpansion_CVE_2023_41047) {
    ASSERT_EQ(upload("{{7*7}}.gcode", "G28\n; {{config}} {% raw %}\n").status, 201);
    EXPECT_EQ(request("GET /api/v1/jobs/1").json()["name"], "{{7*7}}.gcode");
    EXPECT_EQ(request("GET /api/v1/jobs/1/file").body, "G28\n; {{config}} {% raw %}\n");
}

TEST_F(SecurityTest, OtherSitesCannotUseABrowsersCookie) {
    const std::string cookie = log_in();
    EXPECT_EQ(with_cookie("POST /api/v1/live-ticket", cookie, "Origin: http://evil.example\r\n").status, 403);
    EXPECT_EQ(with_cookie("POST /api/v1/live-ticket", cookie).status, 403)
        << "a browser always says where it comes from";
    EXPECT_EQ(with_cookie("POST /api/v1/live-ticket", cookie, "Origin: null\r\n").status, 403);
    EXPECT_EQ(with_cookie("POST /api/v1/live-ticket", cookie, "Origin: http://localhost:8080\r\n").status,
              201);
    const std::string upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\n";
    EXPECT_EQ(with_cookie("GET /api/v1/live", cookie, upgrade + "Origin: http://evil.example\r\n").status,
              403);
    EXPECT_EQ(with_cookie("GET /api/v1/live", cookie, upgrade).status, 403);
    static_cast<void>(with_cookie("GET /api/v1/live", cookie, upgrade + "Origin: http://localhost:8080\r\n"));
    EXPECT_TRUE(connection_->is_live());
}

TEST_F(SecurityTest, ForeignNamesForThisHostAreRefused) {
    for (const char* host : {"evil.example", "127.0.0.1.evil.example:8080", "localhost.evil"}) {
        EXPECT_EQ(send(std::string{"GET / HTTP/1.1\r\nHost: "} + host + "\r\n\r\n").status, 403) << host;
        EXPECT_EQ(send(std::string{"GET /api/v1/jobs HTTP/1.1\r\nHost: "} + host + "\r\nX-Api-Key: " + kKey +
                       "\r\n\r\n")
                      .status,
                  403);
    }
    EXPECT_EQ(send("GET /healthz HTTP/1.1\r\nHost: printer.local:80\r\n\r\n").status, 200);
}

TEST_F(SecurityTest, ATicketOpensOneStreamOnce) {
    const std::string ticket = request("POST /api/v1/live-ticket").json()["ticket"];
    const std::string live =
        "GET /api/v1/live?ticket=" + ticket +
        " HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\r\n";
    static_cast<void>(send(live));
    EXPECT_TRUE(connection_->is_live());
    EXPECT_EQ(send(live).status, 401);
    EXPECT_EQ(send("GET /api/v1/live?ticket=guess HTTP/1.1\r\nHost: localhost\r\nConnection: "
                   "Upgrade\r\nUpgrade: websocket\r\n\r\n")
                  .status,
              401);
}

TEST_F(SecurityTest, WithoutAuthenticationOtherSitesAreStillRefused) {
    open_service("");
    EXPECT_EQ(send("GET /api/v1/jobs HTTP/1.1\r\nHost: localhost\r\n\r\n").status, 200);
    EXPECT_EQ(
        send("GET /api/v1/jobs HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example\r\n\r\n").status,
        403);
}

TEST_F(SecurityTest, ALoginEndsTheSessionThatTheBrowserHadBefore) {
    const std::string old = log_in();
    const std::string body = std::string{R"({"key":")"} + kKey + "\"}";
    EXPECT_EQ(send("POST /api/v1/session HTTP/1.1\r\nHost: localhost\r\nCookie: " + old +
                   "\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body)
                  .status,
              204);
    EXPECT_EQ(with_cookie("GET /api/v1/jobs", old).status, 401);
}

}  // namespace
}  // namespace qduino::web::security_test
