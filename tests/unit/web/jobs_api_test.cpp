// Uploads and jobs over HTTP, as docs/api.md describes them.
#include <gmock/gmock.h>

#include "tests/unit/web/web_fixture.h"
#include "web/api/json.h"

namespace qduino::web::jobs_api_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

using JobsApiTest = WebTest;

TEST_F(JobsApiTest, AnUploadIsHeldUnlessItIsToPrint) {
    const Answer held = upload("a.gcode", "G28\n");
    ASSERT_EQ(held.status, 201);
    EXPECT_EQ(held.json()["state"], "held");
    EXPECT_EQ(held.header("Location"), "/api/v1/jobs/1");
    EXPECT_EQ(upload("b.gcode", "G28\n", {{"print", "true"}}).json()["state"], "queued");
    EXPECT_EQ(upload("c.gcode", "G28\n", {{"hold", "false"}}).json()["state"], "queued");
    EXPECT_EQ(upload("d.gcode", "G28\n", {{"print", "true"}, {"hold", "true"}}).json()["state"], "held");
}

TEST_F(JobsApiTest, AJobHasTheFormOfTheContract) {
    const auto job =
        upload("½ x.gcode", "G28\n", {{"print", "true"}, {"copies", "3"}, {"priority", "-2"}}).json();
    EXPECT_EQ(job["id"], 1);
    EXPECT_EQ(job["name"], "½ x.gcode");
    EXPECT_EQ(job["size"], 4);
    EXPECT_EQ(job["sha256"], spool::sha256_of("G28\n"));
    EXPECT_EQ(job["copies"], 3);
    EXPECT_EQ(job["copies_done"], 0);
    EXPECT_EQ(job["priority"], -2);
    EXPECT_EQ(job["position"], 1);
    EXPECT_TRUE(job["started"].is_null());
    EXPECT_THAT(job["created"].get<std::string>(), ::testing::MatchesRegex("....-..-..T..:..:..Z"));
    EXPECT_EQ(job["facts"]["layers"], 2);
    EXPECT_EQ(job["facts"]["thumbnail"], true);
    EXPECT_EQ(job["progress"]["fraction"], 0.0);
}

TEST_F(JobsApiTest, PutTakesTheRawBody) {
    const Answer answer = request("PUT /api/v1/jobs/my%20part.gcode", "G28\n", "Print-After-Upload: ?1\r\n");
    ASSERT_EQ(answer.status, 201);
    EXPECT_EQ(answer.json()["name"], "my part.gcode");
    EXPECT_EQ(answer.json()["state"], "queued");
    EXPECT_EQ(request("PUT /api/v1/jobs/b.gcode", "G28\n").json()["state"], "held");
}

TEST_F(JobsApiTest, ADeclaredChecksumMustFit) {
    const std::string right = "X-Content-SHA256: " + spool::sha256_of("G28\n") + "\r\n";
    EXPECT_EQ(request("PUT /api/v1/jobs/a.gcode", "G28\n", right).status, 201);
    const Answer wrong = request("PUT /api/v1/jobs/a.gcode", "G29\n", right);
    EXPECT_EQ(wrong.status, 422);
    EXPECT_EQ(wrong.error_code(), "corrupt");
    EXPECT_EQ(spool_->queue().size(), 1u);
    EXPECT_EQ(files_in("incoming"), 0u);
}

TEST_F(JobsApiTest, WhatDoesNotFitTheMachineIsRefusedWithItsLine) {
    const Answer answer = upload("a.gcode", "G28\nG1 X1\nbad\n");
    EXPECT_EQ(answer.status, 422);
    EXPECT_EQ(answer.json()["error"]["line"], 3);
    EXPECT_EQ(answer.json()["error"]["message"], "too hot");
    EXPECT_EQ(spool_->queue().size(), 0u);
    EXPECT_EQ(files_in("incoming") + files_in("blobs"), 0u);
}

TEST_F(JobsApiTest, WhatIsNoGcodeIsRefused) {
    EXPECT_EQ(upload("a.gcode", "not gcode\n").status, 415);
    EXPECT_EQ(spool_->queue().size(), 0u);
}

TEST_F(JobsApiTest, BadUploadsAreRefusedAndLeaveNothing) {
    EXPECT_EQ(upload("", "G28\n").status, 400) << "no name";
    EXPECT_EQ(upload("a.gcode", "").status, 400) << "empty";
    EXPECT_EQ(upload("a.gcode", "G28\n", {{"copies", "0"}}).status, 400);
    EXPECT_EQ(upload("a.gcode", "G28\n", {{"copies", "many"}}).status, 400);
    EXPECT_EQ(upload("a.gcode", "G28\n", {{"priority", "99999"}}).status, 400);
    EXPECT_EQ(upload("a.gcode", "G28\n", {{"note", std::string(5000, 'x')}}).status, 400);
    EXPECT_EQ(upload("a.gcode", std::string((1 << 20) + 1, 'G')).status, 413);
    EXPECT_EQ(request("POST /api/v1/jobs", "G28\n", "Content-Type: text/plain\r\n").status, 415);
    EXPECT_EQ(request("POST /api/v1/jobs", "x", "Content-Type: multipart/form-data\r\n").status, 400);
    EXPECT_EQ(request("POST /api/v1/jobs", "", kMultipart).status, 411);
    const std::string two =
        multipart("a", "G28\n").substr(0, multipart("a", "G28\n").size() - 8) + multipart("b", "G28\n");
    EXPECT_EQ(request("POST /api/v1/jobs", two, kMultipart).status, 400) << "two files";
    EXPECT_EQ(spool_->queue().size(), 0u);
    EXPECT_EQ(files_in("incoming") + files_in("blobs"), 0u);
}

TEST_F(JobsApiTest, AnAnnouncedGiantIsRefusedBeforeItIsSent) {
    const Answer answer =
        send(std::string{"PUT /api/v1/jobs/a.gcode HTTP/1.1\r\nHost: localhost\r\nX-Api-Key: "} + kKey +
             "\r\nContent-Length: 99999999999\r\nExpect: 100-continue\r\n\r\n");
    EXPECT_EQ(answer.status, 413);
}

TEST_F(JobsApiTest, ChunkedUploadsWork) {
    const Answer answer =
        send(std::string{"PUT /api/v1/jobs/a.gcode HTTP/1.1\r\nHost: localhost\r\nX-Api-Key: "} + kKey +
             "\r\nTransfer-Encoding: chunked\r\n\r\n4\r\nG28\n\r\n4\r\nG29\n\r\n0\r\n\r\n");
    ASSERT_EQ(answer.status, 201);
    EXPECT_EQ(answer.json()["sha256"], spool::sha256_of("G28\nG29\n"));
}

TEST_F(JobsApiTest, FilesLayersAndThumbnailsAreServed) {
    static_cast<void>(upload("a.gcode", "G28\n"));
    const Answer file = request("GET /api/v1/jobs/1/file");
    EXPECT_EQ(file.body, "G28\n");
    EXPECT_EQ(file.header("Content-Disposition"), "attachment; filename=\"a.gcode\"");
    EXPECT_EQ(request("GET /api/v1/jobs/1/thumbnail").body, "\x89PNG");
    EXPECT_EQ(request("GET /api/v1/jobs/1/layers").json()["layers"].size(), 2u);
    EXPECT_EQ(request("GET /api/v1/jobs/1/layers/0-0").body, "AAA");
    EXPECT_EQ(request("GET /api/v1/jobs/1/layers/1-1").body, "BBBBB");
    EXPECT_EQ(request("GET /api/v1/jobs/1/layers/0-1").body, "AAABBBBB");
    EXPECT_EQ(request("GET /api/v1/jobs/1/layers/1").body, "BBBBB");
    for (const char* bad : {"1-0", "0-2", "x", "-1-0", "0-", "0-99999999999999999999"}) {
        EXPECT_EQ(request(std::string{"GET /api/v1/jobs/1/layers/"} + bad).status, 404) << bad;
    }
    EXPECT_EQ(request("GET /api/v1/jobs/1/inspection").status, 404);
}

TEST_F(JobsApiTest, JobsAreListedReorderedChangedAndDeleted) {
    for (const char* name : {"a", "b", "c"}) static_cast<void>(upload(name, "G28\n", {{"print", "true"}}));
    EXPECT_EQ(request("PATCH /api/v1/jobs/3", R"({"before":1})").json()["position"], 1);
    EXPECT_EQ(request("PATCH /api/v1/jobs/1", R"({"before":null})").json()["position"], 3);
    EXPECT_EQ(request("PATCH /api/v1/jobs/2", R"({"hold":true,"copies":5,"priority":7})").json()["state"],
              "held");
    std::vector<int> order;
    const auto listing = request("GET /api/v1/jobs").json();
    for (const auto& job : listing["jobs"]) order.push_back(job["id"]);
    EXPECT_THAT(order, ElementsAre(2, 3, 1));
    EXPECT_EQ(request("DELETE /api/v1/jobs/3").status, 204);
    EXPECT_EQ(request("GET /api/v1/jobs/3").status, 404);
    EXPECT_EQ(request("POST /api/v1/jobs/2/start").json()["state"], "queued");
}

class JobPagesTest : public WebTest {
  protected:
    /// `count` ended jobs, straight into the journal: 1 is the oldest.
    void put_ended(int count) {
        spool::Commit commit;
        for (int id = 1; id <= count; ++id) {
            spool::Job job;
            job.id = job.order = id;
            job.name = (id % 2 == 0 ? "Even " : "odd ") + std::to_string(id) + ".gcode";
            job.sha256 = spool::sha256_of(job.name);
            job.state = id % 10 == 0 ? spool::JobState::failed : spool::JobState::done;
            job.facts_json = R"({"layers":3})";
            if (id % 10 == 0) job.error = "why", job.stopped_line = 812, job.stopped_layer = 14;
            commit.jobs.put.push_back(job);
        }
        ASSERT_TRUE(spool_->store().commit(commit).ok());
        open_service();
    }
    std::vector<int> ids(const std::string& query) {
        const auto page = request("GET /api/v1/jobs" + query).json();
        std::vector<int> found;
        for (const auto& job : page["jobs"]) found.push_back(job["id"]);
        next_before_ = page["next_before"];
        return found;
    }
    nlohmann::json next_before_;
};

TEST_F(JobPagesTest, ThePagesHaveTheFormOfTheContract) {
    put_ended(70);
    static_cast<void>(upload("waits.gcode", "G28\n", {{"print", "true"}}));
    static_cast<void>(upload("held.gcode", "G29\n"));
    const auto page = request("GET /api/v1/jobs").json();
    EXPECT_EQ(page["jobs"].size(), 52u) << "all that wait, and 50 of the ended";
    EXPECT_EQ(page["next_before"], 21);
    EXPECT_EQ(page["counts"],
              nlohmann::json::parse(
                  R"({"queued":1,"held":1,"printing":0,"done":63,"cancelled":0,"failed":7,"total":72})"));
    EXPECT_EQ(page["queue"], nlohmann::json::parse(
                                 R"({"held":false,"reason":null,"bed_occupied":false,"confirm_bed":false})"));
    const auto& failed = page["jobs"][2];
    EXPECT_EQ(failed["id"], 70);
    EXPECT_EQ(failed["stopped_line"], 812);
    EXPECT_EQ(failed["stopped_layer"], 14);
    EXPECT_TRUE(page["jobs"][3]["stopped_line"].is_null() && page["jobs"][3]["stopped_layer"].is_null());
    const auto next = request("GET /api/v1/jobs?limit=100&before=21").json();
    EXPECT_EQ(next["jobs"].size(), 20u);
    EXPECT_EQ(next["jobs"][0]["id"], 20);
    EXPECT_TRUE(next["next_before"].is_null());
    EXPECT_EQ(next["counts"], page["counts"]) << "of all jobs, however many a page lists";
}

TEST_F(JobPagesTest, StatesAndPartsOfNamesAreLookedFor) {
    put_ended(40);
    static_cast<void>(upload("Even more.gcode", "G28\n", {{"print", "true"}}));
    EXPECT_THAT(ids("?state=failed&limit=3"), ElementsAre(40, 30, 20));
    EXPECT_EQ(next_before_, 20);
    EXPECT_THAT(ids("?state=failed&limit=3&before=20"), ElementsAre(10));
    EXPECT_THAT(ids("?q=eVEN+m"), ElementsAre(41));
    EXPECT_THAT(ids("?q=EVEN%201"), ElementsAre(18, 16, 14, 12, 10));
    EXPECT_THAT(ids("?state=queued,failed&q=even%203"), ElementsAre(30));
    EXPECT_THAT(ids("?state=queued%2Cheld"), ElementsAre(41));
    EXPECT_THAT(ids("?q=no+such+thing"), ElementsAre());
    EXPECT_THAT(ids("?state=printing,paused"), ElementsAre());
    EXPECT_THAT(ids("?state=&q=&limit=2"), ElementsAre(41, 40, 39)) << "the first page";
    EXPECT_THAT(ids("?limit=1&before=41"), ElementsAre(40));
}

TEST_F(JobPagesTest, WhatPrintsIsFoundByTheWordThatItShows) {
    start_sketch();
    run(2);
    static_cast<void>(upload("a", spool::content_of(1'000'000, 1), {{"print", "true"}}));
    run(4, 10'000);
    EXPECT_THAT(ids("?state=printing"), ElementsAre(1));
    EXPECT_THAT(ids("?state=paused"), ElementsAre());
    ASSERT_EQ(request("POST /api/v1/machine/pause").status, 202);
    run(2, 10'000);
    EXPECT_THAT(ids("?state=paused"), ElementsAre(1));
    EXPECT_EQ(request("GET /api/v1/jobs").json()["counts"]["printing"], 1);
}

TEST_F(JobPagesTest, ParametersOutOfRangeAreRefusedWithWords) {
    for (const char* bad :
         {"limit=0", "limit=1001", "limit=-1", "limit=x", "limit=", "limit=99999999999999999999"}) {
        const Answer answer = request("GET /api/v1/jobs?" + std::string{bad});
        EXPECT_EQ(answer.status, 422) << bad;
        EXPECT_THAT(answer.json()["error"]["message"].get<std::string>(), HasSubstr("1 to 1000")) << bad;
    }
    for (const char* bad :
         {"before=0", "before=x", "before=-3", "state=lost", "state=done,", "q=%ff", "q=%4", "limit=%zz"}) {
        const Answer answer = request("GET /api/v1/jobs?" + std::string{bad});
        EXPECT_EQ(answer.status, 400) << bad;
        EXPECT_FALSE(answer.json()["error"]["message"].get<std::string>().empty()) << bad;
    }
    EXPECT_EQ(request("GET /api/v1/jobs?q=" + std::string(201, 'a')).status, 400);
    EXPECT_EQ(request("GET /api/v1/jobs?before=777").status, 200) << "deleted meanwhile: from the start";
    EXPECT_EQ(request("GET /api/v1/jobs?something=else").status, 200);
}

TEST_F(JobPagesTest, EveryListIsBoundedHoweverManyJobsThereAre) {
    put_ended(3000);
    EXPECT_EQ(spool_->queue().size(), 0u);
    EXPECT_EQ(request("GET /api/v1/jobs").json()["jobs"].size(), 50u);
    EXPECT_EQ(request("GET /api/v1/jobs?limit=1000").json()["jobs"].size(), 1000u);
    EXPECT_EQ(request("GET /api/files").json()["files"].size(), 50u);
    EXPECT_LE(request("GET /api/v1/jobs").body.size(), 50 * 1024u) << "no bulky fields";
    EXPECT_EQ(api::jobs_json(*spool_)["jobs"].size(), 50u) << "the live stream";
}

TEST_F(JobPagesTest, AFullStoreIsSaidWith507) {
    options_.retention.bytes_max = 5000;
    open_service();
    ASSERT_EQ(upload("a.gcode", std::string(3000, 'G'), {{"print", "true"}}).status, 201);
    const Answer refused = upload("b.gcode", std::string(3001, 'G'), {{"print", "true"}});
    EXPECT_EQ(refused.status, 507);
    EXPECT_THAT(refused.json()["error"]["message"].get<std::string>(), HasSubstr("--store-limit-mib"));
    EXPECT_EQ(files_in("incoming"), 0u);
}

TEST_F(JobsApiTest, TheQueueSaysWhenEachJobStarts) {
    static_cast<void>(upload("a", "G28\n", {{"print", "true"}, {"copies", "2"}}));
    static_cast<void>(upload("b", "G28\n"));
    static_cast<void>(upload("c", "G28\n", {{"print", "true"}}));
    const auto jobs = request("GET /api/v1/jobs").json()["jobs"];
    EXPECT_EQ(jobs[0]["starts_in_s"], 0.0);
    EXPECT_TRUE(jobs[1]["starts_in_s"].is_null()) << "held";
    EXPECT_EQ(jobs[2]["starts_in_s"], 200.0) << "two copies of 100 s before it";
    EXPECT_EQ(request("GET /api/v1/jobs/3").json()["starts_in_s"], 200.0);
}

TEST_F(JobsApiTest, TheStatusSaysWhenEachWaitingJobIsReady) {
    start_sketch();
    run(2);
    static_cast<void>(upload("a", spool::content_of(1'000'000, 1), {{"print", "true"}, {"copies", "2"}}));
    run(2, 100'000);
    sketch_->status().print_time_s = 30;
    run(2, 100'000);
    static_cast<void>(upload("b", "G28\n", {{"print", "true"}, {"copies", "3"}}));
    static_cast<void>(upload("c", "G28\n"));
    static_cast<void>(upload("d", "G28\n", {{"print", "true"}}));
    auto status = request("GET /api/v1/machine").json();
    const double left_s = status["progress"]["remaining_s"];
    EXPECT_GT(left_s, 0);
    EXPECT_LT(left_s, 500) << "100 s, at the pace of what has been printed";
    EXPECT_GT(status["progress"]["bytes"], 0);
    const double elapsed_s = status["progress"]["elapsed_s"];
    EXPECT_EQ(elapsed_s, 30);
    EXPECT_NEAR(status["progress"]["fraction"].get<double>(), elapsed_s / (elapsed_s + left_s), 1e-9)
        << "percents are of the time, as what is left is";
    EXPECT_EQ(status["ready_in_s"].size(), 2u) << "not what is held";
    EXPECT_NEAR(status["ready_in_s"]["2"].get<double>(), left_s + 100 + 300, 0.51);
    EXPECT_NEAR(status["ready_in_s"]["4"].get<double>(), left_s + 100 + 400, 0.51);
    EXPECT_EQ(status["progress"], request("GET /api/v1/jobs/1").json()["progress"]);
    ASSERT_EQ(request("POST /api/v1/queue/hold").status, 202);
    status = request("GET /api/v1/machine").json();
    EXPECT_TRUE(status["ready_in_s"].empty()) << "the queue does not go on by itself";
    EXPECT_FALSE(status["progress"].is_null());
}

TEST_F(JobsApiTest, WithoutAnEstimateTheTimeLeftGoesByTheTimeTaken) {
    analyzer_.estimated_s = 0;
    start_sketch();
    run(2);
    static_cast<void>(upload("a", spool::content_of(1'000'000, 1), {{"print", "true"}}));
    static_cast<void>(upload("b", "G28\n", {{"print", "true"}}));
    run(3, 1000);
    auto progress = request("GET /api/v1/jobs/1").json()["progress"];
    ASSERT_LE(progress["fraction"], 0.01);
    EXPECT_TRUE(progress["remaining_s"].is_null()) << "nobody knows yet";
    run(4, 100'000);
    progress = request("GET /api/v1/machine").json()["progress"];
    const double fraction = progress["fraction"];
    EXPECT_NEAR(progress["remaining_s"].get<double>(),
                progress["elapsed_s"].get<double>() * (1 / fraction - 1), 1e-6);
    EXPECT_TRUE(request("GET /api/v1/machine").json()["ready_in_s"].empty())
        << "nobody knows how long b takes";
}

TEST_F(JobsApiTest, PatchesOfTheWrongFormChangeNothing) {
    static_cast<void>(upload("a", "G28\n"));
    for (const char* bad : {"", "[]", "{", R"({"hold":1})", R"({"copies":"2"})", R"({"copies":1.5})",
                            R"({"copies":0})", R"({"copies":99999999999999999999})", R"({"before":"1"})",
                            R"({"state":"done"})", R"({"priority":null})"}) {
        EXPECT_EQ(request("PATCH /api/v1/jobs/1", bad).status, 400) << bad;
    }
    EXPECT_EQ(request("PATCH /api/v1/jobs/1", R"({"before":77})").status, 404);
    EXPECT_EQ(request("PATCH /api/v1/jobs/x", "{}").status, 404);
    EXPECT_TRUE(spool_->queue().find(1)->hold);
}

TEST_F(JobsApiTest, APrintingJobCannotBeDeletedAndShowsItsProgress) {
    start_sketch();
    run(2);
    static_cast<void>(upload("a", spool::content_of(1'000'000, 1), {{"print", "true"}}));
    run(2, 100'000);
    sketch_->status().print_time_s = 30;
    run(2, 100'000);
    const auto job = request("GET /api/v1/jobs/1").json();
    EXPECT_EQ(job["state"], "printing");
    EXPECT_GT(job["progress"]["fraction"], 0.0);
    EXPECT_GT(job["progress"]["remaining_s"], 0.0);
    EXPECT_TRUE(job["position"].is_null());
    EXPECT_EQ(request("DELETE /api/v1/jobs/1").status, 409);
    ASSERT_EQ(request("POST /api/v1/machine/pause").status, 202);
    run(2, 100'000);
    EXPECT_EQ(request("GET /api/v1/jobs/1").json()["state"], "paused");
    ASSERT_EQ(request("POST /api/v1/machine/cancel").status, 202);
    run(80);
    EXPECT_EQ(request("GET /api/v1/jobs/1").json()["state"], "cancelled");
}

TEST_F(JobsApiTest, AFailureHoldsTheQueueWithItsReason) {
    start_sketch();
    run(2);
    static_cast<void>(upload("a", spool::content_of(1'000'000, 1), {{"print", "true"}}));
    run(4, 1000);
    sketch_->fault("thermistor of the hot end is out of range");
    run(3);
    const auto listing = request("GET /api/v1/jobs").json();
    EXPECT_EQ(listing["jobs"][0]["state"], "failed");
    EXPECT_EQ(listing["jobs"][0]["error"], "thermistor of the hot end is out of range");
    EXPECT_EQ(listing["queue"]["held"], true);
    EXPECT_THAT(listing["queue"]["reason"].get<std::string>(), HasSubstr("thermistor"));
    EXPECT_EQ(request("POST /api/v1/queue/release").status, 202);
    EXPECT_EQ(request("GET /api/v1/jobs").json()["queue"]["held"], false);
    EXPECT_EQ(request("POST /api/v1/queue/hold").status, 202);
    EXPECT_EQ(request("GET /api/v1/jobs").json()["queue"]["held"], true);
}

TEST_F(JobsApiTest, TheLiveStreamTellsOfUploadsJobsAndStatus) {
    Publisher publisher{*spool_, *service_, thread_.executors().io, [](const std::string&) {}};
    std::vector<nlohmann::json> got;
    ASSERT_TRUE(service_->live().subscribe(
        [&](MessageKind, const Message& text) { got.push_back(nlohmann::json::parse(*text)); }));
    static_cast<void>(upload("a.gcode", std::string(200, 'G'), {{"print", "true"}}));
    start_sketch();
    for (int i = 0; i < 20; ++i) {
        now_ += std::chrono::milliseconds{100};
        publisher.tick(moment());
        sketch_->step(1 << 20);
    }
    const auto count = [&](const char* type) {
        return std::count_if(got.begin(), got.end(),
                             [&](const auto& message) { return message["type"] == type; });
    };
    EXPECT_EQ(count("upload"), 2) << "its beginning and its end";
    EXPECT_GE(count("status"), 15);
    EXPECT_GE(count("jobs"), 3) << "queued, printing, done";
    EXPECT_EQ(count("alive"), 2) << "one in each of the two seconds";
    const auto alive =
        std::ranges::find_if(got, [](const auto& message) { return message["type"] == "alive"; });
    EXPECT_THAT((*alive)["time"].get<std::string>(), ::testing::MatchesRegex("....-..-..T..:..:..Z"));
    EXPECT_EQ(got.back()["type"], "status");
    EXPECT_EQ(got.back()["status"]["state"], "idle");
}

}  // namespace
}  // namespace qduino::web::jobs_api_test
