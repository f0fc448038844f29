// The requests of slicers and their answers: OctoPrint's and PrusaLink's forms (docs/sources.md).
#include <gmock/gmock.h>

#include "tests/unit/web/web_fixture.h"

namespace qduino::web::slicer_api_test {
namespace {

using ::testing::StartsWith;

using SlicerApiTest = WebTest;

TEST_F(SlicerApiTest, VersionSatisfiesPrusaSlicerForBothHostTypes) {
    const auto version = request("GET /api/version").json();
    EXPECT_TRUE(version["api"].is_string());
    EXPECT_TRUE(version["server"].is_string());
    EXPECT_THAT(version["text"].get<std::string>(), StartsWith("OctoPrint"));
    EXPECT_EQ(version["capabilities"]["upload-by-put"], true);
    EXPECT_EQ(send("GET /api/version HTTP/1.1\r\nHost: localhost\r\n\r\n").status, 401);
}

TEST_F(SlicerApiTest, OctoPrintUpload) {
    const Answer answer = upload("part.gcode", "G28\n", {{"print", "true"}, {"path", ""}, {"select", "true"}},
                                 "/api/files/local");
    ASSERT_EQ(answer.status, 201);
    EXPECT_EQ(answer.header("Location"), "http://localhost/api/v1/jobs/1");
    const auto json = answer.json();
    EXPECT_EQ(json["done"], true);
    EXPECT_EQ(json["files"]["local"]["name"], "part.gcode");
    EXPECT_EQ(json["files"]["local"]["origin"], "local");
    EXPECT_FALSE(spool_->queue().find(1)->hold);
    EXPECT_EQ(upload("part.gcode", "G28\n", {{"print", "false"}}, "/api/files/local").status, 201);
    EXPECT_TRUE(spool_->queue().find(2)->hold);
}

TEST_F(SlicerApiTest, AFolderOfTheSlicersDialogueBecomesAPartOfTheName) {
    const auto name_of = [this](spool::JobId id) { return spool_->queue().find(id)->name; };
    ASSERT_EQ(request("PUT /api/v1/files/local/lids/large/box.gcode", "G28\n").status, 201);
    EXPECT_EQ(name_of(1), "lids - large - box.gcode");
    ASSERT_EQ(request("PUT /api/v1/files/local/lids%2Fbox.gcode", "G28\n").status, 201);
    EXPECT_EQ(name_of(2), "lids - box.gcode");
    spool::JobId id = 2;
    for (const char* folder : {"lids", "lids/"}) {
        ASSERT_EQ(upload("box.gcode", "G28\n", {{"path", folder}}, "/api/files/local").status, 201);
        EXPECT_EQ(name_of(++id), "lids - box.gcode");
    }
    for (const char* bad : {"..", "a/../b", "a//b", "/etc", "a\\b", "a/.", "//"}) {
        EXPECT_EQ(upload("box.gcode", "G28\n", {{"path", bad}}, "/api/files/local").status, 400) << bad;
    }
    for (const char* bad : {"../x.gcode", "a/../b.gcode", "a//b.gcode", "a%2F..%2Fb.gcode", "a/"})
        EXPECT_EQ(request("PUT /api/v1/files/local/" + std::string{bad}, "G28\n").status, 400) << bad;
    EXPECT_EQ(
        upload(std::string(190, 'n'), "G28\n", {{"path", std::string(20, 'f')}}, "/api/files/local").status,
        400)
        << "too long together";
    EXPECT_EQ(spool_->queue().size(), 4u);
    EXPECT_EQ(files_in("incoming"), 0u);
}

TEST_F(SlicerApiTest, BooleansAreTakenInAnyCaseAndNothingElseIs) {
    spool::JobId id = 0;
    for (const char* yes : {"true", "True", "TRUE", "yes", "Y", "on", "1"}) {
        ASSERT_EQ(upload("a", "G28\n", {{"print", yes}}, "/api/files/local").status, 201) << yes;
        EXPECT_FALSE(spool_->queue().find(++id)->hold) << yes;
    }
    for (const char* no : {"false", "False", "no", "N", "Off", "0", ""}) {
        ASSERT_EQ(upload("a", "G28\n", {{"print", no}}, "/api/files/local").status, 201) << no;
        EXPECT_TRUE(spool_->queue().find(++id)->hold) << no;
    }
    EXPECT_EQ(upload("a", "G28\n", {{"print", "perhaps"}}, "/api/files/local").status, 400);
}

TEST_F(SlicerApiTest, AJobWithoutAStartIsOfferedOneAndTakenWithIt) {
    const Answer refused = upload("a", "unhomed\nG1 X1\n", {{"print", "true"}});
    ASSERT_EQ(refused.status, 422);
    EXPECT_EQ(refused.json()["error"]["offer"]["prologue"], "homes\n");
    EXPECT_FALSE(upload("a", "bad\n").json()["error"].contains("offer"));
    ASSERT_EQ(upload("a", "unhomed\nG1 X1\n", {{"print", "true"}, {"prologue", "True"}}).status, 201);
    EXPECT_EQ(request("GET /api/v1/jobs/1/file").body, "homes\nunhomed\nG1 X1\n");
    EXPECT_EQ(upload("a", "bad\n", {{"prologue", "true"}}).status, 422);
    // Where nothing is missing nothing is added.
    ASSERT_EQ(upload("b", "G28\n", {{"prologue", "true"}}).status, 201);
    EXPECT_EQ(request("GET /api/v1/jobs/2/file").body, "G28\n");
}

TEST_F(SlicerApiTest, TheMachineFilesNumbersAreTold) {
    EXPECT_EQ(request("GET /api/version").json()["nozzle_diameter"], 0.6);
    const auto info = request("GET /api/v1/info").json();
    EXPECT_EQ(info["nozzle_diameter"], 0.6);
    EXPECT_EQ(info["min_extrusion_temp"], 180.0);
}

// What PrusaSlicer and OrcaSlicer do as a host of the type Moonraker: they ask, and upload.
TEST_F(SlicerApiTest, ASlicerThatSpeaksMoonrakerUploadsAndStarts) {
    EXPECT_EQ(send("GET /server/info HTTP/1.1\r\nHost: localhost\r\n\r\n").status, 401);
    auto info = request("GET /server/info").json();
    EXPECT_EQ(info["result"]["klippy_state"], "disconnected");
    EXPECT_TRUE(info["result"]["moonraker_version"].is_string());
    start_sketch();
    run(3);
    info = request("GET /server/info").json();
    EXPECT_EQ(info["result"]["klippy_state"], "ready");
    EXPECT_EQ(info["result"]["klippy_connected"], true);

    const auto send_file = [this](const std::map<std::string, std::string>& fields) {
        return upload("part.gcode", "G28\n", fields, "/server/files/upload");
    };
    const Answer kept = send_file({{"root", "gcodes"}, {"print", "false"}});
    ASSERT_EQ(kept.status, 201);
    EXPECT_EQ(kept.json()["result"]["item"]["path"], "part.gcode");
    EXPECT_EQ(kept.json()["result"]["item"]["root"], "gcodes");
    EXPECT_EQ(kept.json()["result"]["print_queued"], false);
    EXPECT_TRUE(spool_->queue().find(1)->hold);
    const Answer printed = send_file({{"root", "gcodes"}, {"path", "lids"}, {"print", "true"}});
    ASSERT_EQ(printed.status, 201);
    EXPECT_EQ(printed.json()["result"]["print_queued"], true);
    EXPECT_EQ(printed.json()["result"]["item"]["path"], "lids - part.gcode");
    EXPECT_EQ(send_file({{"root", "config"}}).status, 400);
    EXPECT_EQ(request("POST /server/info", "{}").status, 405);
    EXPECT_EQ(spool_->queue().size(), 2u);
}

// A slicer shows the message of the error to its user, who sees there what to choose instead.
TEST_F(SlicerApiTest, WhoSpeaksMoonrakerIsToldWhatToChoose) {
    for (const char* const asked :
         {"GET /server/files/list", "POST /printer/print/start", "GET /printer/info",
          "GET /access/oneshot_token", "GET /machine/system_info", "GET /websocket"}) {
        const Answer answer = request(asked);
        EXPECT_EQ(answer.status, 404) << asked;
        const auto said = answer.json()["error"]["message"].get<std::string>();
        EXPECT_NE(said.find("Moonraker"), std::string::npos) << asked << ": " << said;
        EXPECT_NE(said.find("OctoPrint"), std::string::npos) << asked << ": " << said;
    }
    EXPECT_EQ(request("GET /servers").json()["error"]["message"], "there is no such page");
}

TEST_F(SlicerApiTest, PrusaLinkUploadByPut) {
    const Answer answer = request("PUT /api/v1/files/local/part%20%C3%BC.gcode", "G28\n",
                                  "Overwrite: ?1\r\nPrint-After-Upload: ?1\r\n");
    ASSERT_EQ(answer.status, 201);
    EXPECT_EQ(spool_->queue().find(1)->name, "part ü.gcode");
    EXPECT_FALSE(spool_->queue().find(1)->hold);
}

TEST_F(SlicerApiTest, CuraPolls) {
    start_sketch();
    run(3);
    EXPECT_EQ(request("GET /api/printer").json()["state"]["flags"]["operational"], true);
    EXPECT_EQ(request("GET /api/printer").json()["temperature"]["tool0"]["target"], 0.0);
    EXPECT_EQ(request("GET /api/job").json()["state"], "Operational");
    EXPECT_EQ(request("GET /api/settings").status, 200);
    EXPECT_EQ(request("GET /api/printerprofiles").json()["profiles"]["_default"]["volume"]["width"], 150.0);
    EXPECT_EQ(request("POST /api/login", R"({"passive":true})").json()["name"], "_api");
    EXPECT_EQ(request("POST /api/login", R"({"user":"a","pass":"b"})").status, 403);
    EXPECT_EQ(request("POST /api/printer/command", R"({"commands":["M105","M114"]})").status, 204);
    EXPECT_EQ(request("POST /api/printer/command", R"({"commands":7})").status, 400);
    EXPECT_EQ(request("POST /api/printer/command", "{}").status, 400);
}

TEST_F(SlicerApiTest, TheConnectionIsTheMachinesOwn) {
    EXPECT_EQ(request("GET /api/connection").json()["current"]["state"], "Offline");
    start_sketch();
    run(3);
    const auto json = request("GET /api/connection").json();
    EXPECT_EQ(json["current"]["state"], "Operational");
    EXPECT_EQ(json["current"]["printerProfile"], json["options"]["printerProfiles"][0]["id"]);
}

TEST_F(SlicerApiTest, JobControlInBothDialects) {
    start_sketch();
    run(3);
    static_cast<void>(upload("a", spool::content_of(900'000, 1), {{"print", "true"}}));
    run(3, 1000);
    EXPECT_EQ(request("GET /api/job").json()["state"], "Printing");
    EXPECT_EQ(request("GET /api/v1/status").json()["printer"]["state"], "PRINTING");
    EXPECT_EQ(request("GET /api/v1/job").json()["id"], 1);
    EXPECT_EQ(request("PUT /api/v1/job/2/pause").status, 404) << "another job than the one that prints";
    EXPECT_EQ(request("PUT /api/v1/job/1/pause").status, 204);
    run(2, 1000);
    EXPECT_EQ(request("GET /api/v1/status").json()["printer"]["state"], "PAUSED");
    EXPECT_EQ(request("POST /api/job", R"({"command":"pause","action":"toggle"})").status, 204);
    run(2, 1000);
    EXPECT_EQ(request("GET /api/job").json()["state"], "Printing");
    EXPECT_EQ(request("POST /api/job", R"({"command":"pause","action":"pause"})").status, 204);
    run(2, 1000);
    EXPECT_EQ(request("PUT /api/v1/job/1/resume").status, 204);
    run(2, 1000);
    EXPECT_EQ(request("DELETE /api/v1/job/1").status, 204);
    run(60, 1000);
    EXPECT_EQ(request("GET /api/v1/job").status, 204);
    EXPECT_EQ(request("POST /api/job", R"({"command":"cancel"})").status, 409);
    EXPECT_EQ(request("POST /api/job", R"({"command":"explode"})").status, 400);
}

TEST_F(SlicerApiTest, PrusaLinkInformation) {
    EXPECT_EQ(request("GET /api/v1/info").status, 200);
    EXPECT_EQ(request("GET /api/v1/storage").json()["storage_list"][0]["path"], "/local");
    EXPECT_EQ(request("GET /api/v1/transfer").status, 204);
    EXPECT_EQ(request("GET /api/v1/status").json()["printer"]["state"], "ERROR") << "no machine";
}

}  // namespace
}  // namespace qduino::web::slicer_api_test
