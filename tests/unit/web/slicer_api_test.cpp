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

// ---- Duet: the key comes once, as a password, and then the address alone ------------------------

class DuetTest : public WebTest {
  protected:
    /// As a slicer asks: without a key.
    Answer ask(const std::string& target, const std::string& more = "",
               const std::string& remote = "10.0.0.7") {
        return send("GET /" + target + " HTTP/1.1\r\nHost: localhost\r\nUser-Agent: PrusaSlicer/2.9\r\n" +
                        more + "\r\n",
                    remote);
    }
    Answer send_file(const std::string& query, const std::string& content) {
        return send("POST /rr_upload?" + query +
                        " HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/x-www-form-urlencoded\r\n"
                        "Content-Length: " +
                        std::to_string(content.size()) + "\r\n\r\n" + content,
                    "10.0.0.7");
    }
    int connect_with(const std::string& password) {
        const Answer answer = ask("rr_connect?password=" + password + "&time=2026-11-27T14:00:00");
        return answer.status == 200 ? answer.json().value("err", -1) : answer.status;
    }
    void connect_rightly() { ASSERT_EQ(connect_with(kKey), 0); }
};

TEST_F(DuetTest, AFileIsUploadedAndPrinted) {
    connect_rightly();
    const Answer sent = send_file("name=0:/gcodes/lids%2Fpart%20one.gcode&time=2026-11-27T14:00:00", "G28\n");
    ASSERT_EQ(sent.status, 200) << sent.body;
    EXPECT_EQ(sent.json()["err"], 0);
    ASSERT_NE(spool_->queue().find(1), nullptr);
    EXPECT_EQ(spool_->queue().find(1)->name, "lids - part one.gcode");
    EXPECT_TRUE(spool_->queue().find(1)->hold) << "nobody has asked for it to be printed";
    // The slicer sends the quotes as they are.
    EXPECT_EQ(ask("rr_gcode?gcode=M32%20\"0:/gcodes/lids%2Fpart%20one.gcode\"").status, 200);
    EXPECT_FALSE(spool_->queue().find(1)->hold);
    EXPECT_EQ(ask("rr_disconnect").json()["err"], 0);
    EXPECT_EQ(ask("rr_status").status, 401);
}

TEST_F(DuetTest, OfFilesWithOneNameTheLastIsPrinted) {
    connect_rightly();
    for (const char* content : {"G28\n", "G28\nG1 X1\n"})
        ASSERT_EQ(send_file("name=a.gcode", content).status, 200);
    ASSERT_EQ(send_file("name=0:/gcodes/data.gcode", "G28\n").status, 200);
    EXPECT_EQ(ask("rr_gcode?gcode=M32%20a.gcode").status, 200);
    EXPECT_TRUE(spool_->queue().find(1)->hold);
    EXPECT_FALSE(spool_->queue().find(2)->hold);
    EXPECT_TRUE(spool_->queue().find(3)->hold);
    EXPECT_EQ(ask("rr_gcode?gcode=M32%20%22b.gcode%22").status, 404);
}

TEST_F(DuetTest, WithoutTheKeyNothingIsServed) {
    EXPECT_EQ(connect_with("reprap"), 1) << "what a slicer sends when nobody has typed one";
    EXPECT_EQ(connect_with(""), 1);
    for (const char* target : {"rr_status?type=3", "rr_gcode?gcode=M32%20a.gcode", "rr_gcode?gcode=G28",
                               "rr_filelist?dir=0:/gcodes", "rr_fileinfo?name=a", "rr_disconnect"}) {
        EXPECT_EQ(ask(target).status, 401) << target;
    }
    EXPECT_EQ(send_file("name=a.gcode", "G28\n").status, 401);
    connect_rightly();
    EXPECT_EQ(ask("rr_status").status, 200);
    EXPECT_EQ(ask("rr_status", "", "10.0.0.8").status, 401) << "another address";
    EXPECT_EQ(ask("api/v1/jobs").status, 401) << "of this interface alone";
    EXPECT_EQ(ask("rr_status", "X-Api-Key: a wrong one\r\n").status, 401);
    now_ += 61s;
    EXPECT_EQ(ask("rr_status").status, 401) << "a minute without a word";
    EXPECT_EQ(spool_->queue().size(), 0u);
}

TEST_F(DuetTest, ABrowserIsNotTakenForTheSlicerOfItsComputer) {
    connect_rightly();
    EXPECT_EQ(ask("rr_gcode?gcode=G28", "Sec-Fetch-Site: cross-site\r\n").status, 403);
    EXPECT_EQ(
        send("GET /rr_gcode?gcode=G28 HTTP/1.1\r\nHost: localhost\r\nUser-Agent: Mozilla/5.0 (X11)\r\n\r\n",
             "10.0.0.7")
            .status,
        403);
    open_service("");  // no key is asked for
    EXPECT_EQ(
        send("GET /rr_gcode?gcode=G28 HTTP/1.1\r\nHost: localhost\r\nUser-Agent: Mozilla/5.0 (X11)\r\n\r\n",
             "10.0.0.7")
            .status,
        403);
    EXPECT_EQ(connect_with("reprap"), 0);
}

TEST_F(DuetTest, TooManyWrongPasswordsAreTold) {
    for (int i = 0; i < FailureLimiter::kBurst; ++i) ASSERT_EQ(connect_with("wrong"), 1);
    EXPECT_EQ(connect_with("wrong"), 429);
    EXPECT_EQ(connect_with(kKey), 0) << "the right one is always taken";
}

TEST_F(DuetTest, AVisitLastsAsLongAsItsUpload) {
    constexpr int kPieces = 6;
    const std::string piece = std::string(40'000, ';') + "\n";
    connect_rightly();
    connect("10.0.0.7");
    connection_->receive("POST /rr_upload?name=a.gcode HTTP/1.1\r\nHost: localhost\r\nContent-Length: " +
                             std::to_string(kPieces * piece.size()) + "\r\n\r\n",
                         moment());
    for (int i = 0; i < kPieces; ++i) {
        now_ += 20s;
        connection_->check_time(moment());
        connection_->receive(piece, moment());
    }
    EXPECT_EQ(parse(output()).status, 200) << "after two minutes";
    now_ += 30s;
    EXPECT_EQ(ask("rr_gcode?gcode=M32%20a.gcode").status, 200);
}

TEST_F(DuetTest, AFileThatWasDamagedOrDoesNotFitIsRefused) {
    connect_rightly();
    EXPECT_EQ(send_file("name=a.gcode&crc32=cbf43926", "123456789").status,
              200);  // the standard's check value
    EXPECT_EQ(send_file("name=b.gcode&crc32=cbf43927", "123456789").status, 422);
    for (const char* digits : {"0xcbf43926", "cbf439261", "wrong", "-1"})
        EXPECT_EQ(send_file("name=b.gcode&crc32=" + std::string{digits}, "G28\n").status, 400) << digits;
    const Answer bad = send_file("name=b.gcode", "G28\nbad\n");
    EXPECT_EQ(bad.status, 422);
    EXPECT_EQ(bad.json()["error"]["line"], 2);
    EXPECT_EQ(send_file("name=b.gcode", "not gcode\n").status, 415);
    EXPECT_EQ(send_file("name=b.gcode", std::string(3 << 20, ';')).status, 413);
    for (const char* name :
         {"", "0:/sys/config.g", "/macros/a", "0:/gcodes/", "0:/gcodes/../a", "0:/gcodes/a//b"})
        EXPECT_EQ(send_file("name=" + std::string{name}, "G28\n").status, 400) << name;
    EXPECT_EQ(spool_->queue().size(), 1u);
    EXPECT_EQ(files_in("incoming"), 0u);
}

TEST_F(DuetTest, FilesAreListedAndDescribed) {
    connect_rightly();
    ASSERT_EQ(send_file("name=a.gcode", "G28\n").status, 200);
    ASSERT_EQ(send_file("name=a.gcode", "G28\nG28\n").status, 200);
    const auto list = ask("rr_filelist?dir=0:/gcodes").json();
    EXPECT_EQ(list["err"], 0);
    ASSERT_EQ(list["files"].size(), 1u);
    EXPECT_EQ(list["files"][0]["name"], "a.gcode");
    EXPECT_EQ(list["files"][0]["type"], "f");
    EXPECT_EQ(ask("rr_filelist?dir=0:/sys").json()["err"], 2);
    const auto info = ask("rr_fileinfo?name=0:/gcodes/a.gcode").json();
    EXPECT_EQ(info["err"], 0);
    EXPECT_EQ(info["size"], 8);
    EXPECT_EQ(info["numLayers"], 2);
    EXPECT_EQ(info["printTime"], 100);
    EXPECT_EQ(ask("rr_fileinfo?name=b.gcode").json()["err"], 1);
    EXPECT_EQ(ask("rr_fileinfo").json()["err"], 1) << "nothing prints";
}

TEST_F(DuetTest, TheMachineIsToldAndSpokenTo) {
    connect_rightly();
    EXPECT_EQ(ask("rr_status?type=3").json()["status"], "O");
    EXPECT_EQ(ask("rr_gcode?gcode=G28").status, 503) << "nobody is there to hear it";
    start_sketch();
    run(3);
    EXPECT_EQ(ask("rr_status?type=3").json()["status"], "I");
    EXPECT_EQ(ask("rr_gcode?gcode=").status, 200) << "asks for room alone";
    EXPECT_EQ(ask("rr_gcode?gcode=G28%0AG1%20X10").status, 200);
    EXPECT_EQ(ask("rr_gcode?gcode=M37%20P%22a.gcode%22").status, 501);
    std::string many;
    for (int i = 0; i < 65; ++i) many += "G28%0A";
    EXPECT_EQ(ask("rr_gcode?gcode=" + many).status, 400);
}

}  // namespace
}  // namespace qduino::web::slicer_api_test
