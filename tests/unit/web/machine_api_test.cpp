// The machine over HTTP: the G-code that reaches it, and the requests that are refused before.
#include <gmock/gmock.h>

#include "tests/unit/web/web_fixture.h"

namespace qduino::web::machine_api_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class MachineApiTest : public WebTest {
  protected:
    void SetUp() override {
        WebTest::SetUp();
        start_sketch();
        run(3);
    }
    Answer post(const std::string& action, const std::string& body = "") {
        return request("POST /api/v1/machine/" + action, body);
    }
    void publish(std::string_view guarantee) { layout_->guarantee.write({guarantee}); }
    /// The lines that reached the machine since the last call.
    std::vector<std::string> lines() {
        run(2);
        return std::exchange(printed().gcode, {});
    }
};

TEST_F(MachineApiTest, StatusHasTheFormOfTheContract) {
    const auto status = request("GET /api/v1/machine").json();
    EXPECT_EQ(status["connected"], true);
    EXPECT_EQ(status["state"], "idle");
    EXPECT_TRUE(status["job"].is_null());
    EXPECT_TRUE(status["fault"].is_null());
    EXPECT_EQ(status["session"].get<std::string>().size(), 16u);
    EXPECT_EQ(status["position_mm"].size(), 4u);
    EXPECT_EQ(status["homed"].size(), 3u);
    EXPECT_GT(status["hot_end"]["c"], 0.0);
    EXPECT_EQ(status["timing"]["pulses"].size(), 4u);
    EXPECT_EQ(status["timing"]["lateness_ns"]["count"], 0);
}

TEST_F(MachineApiTest, StatusTellsWhatThePageNeedsOfHeatPauseAndTime) {
    auto status = request("GET /api/v1/machine").json();
    EXPECT_TRUE(status["idle_off_in_s"].is_null());
    EXPECT_EQ(status["idle_timed_out"], false);
    EXPECT_EQ(status["idle_timeout_s"], 600.0);
    EXPECT_EQ(status["parked"], false);
    EXPECT_EQ(status["may_jog"], true);
    EXPECT_EQ(status["time_factor"], 1.0);
    EXPECT_EQ(status["hot_end"]["reading"], true);
    sketch_->heat_status().idle_left_s = 99.5;
    sketch_->heat_status().hot_end.reading = false;
    layout_->time_factor = 20;
    run(2);
    status = request("GET /api/v1/machine").json();
    EXPECT_EQ(status["idle_off_in_s"], 99.5);
    EXPECT_EQ(status["hot_end"]["reading"], false);
    EXPECT_EQ(status["time_factor"], 20.0);
    layout_->time_factor = -1;  // whatever it says, there is a usable number
    run(1);
    EXPECT_EQ(request("GET /api/v1/machine").json()["time_factor"], 1.0);
}

TEST_F(MachineApiTest, WhilePausedTheHeadIsJogged) {
    static_cast<void>(upload("a", spool::content_of(500'000, 1), {{"print", "true"}}));
    run(3, 1000);
    EXPECT_EQ(request("GET /api/v1/machine").json()["may_jog"], false);
    EXPECT_EQ(post("pause").status, 202);
    run(2);
    const auto status = request("GET /api/v1/machine").json();
    EXPECT_EQ(status["parked"], true);
    EXPECT_EQ(status["may_jog"], true);
    EXPECT_EQ(post("jog", R"({"e_mm":-50,"speed_mm_s":5})").status, 202);
    EXPECT_EQ(post("home").status, 409);
}

TEST_F(MachineApiTest, AJogBeforeHomingIsRefused) {
    sketch_->status().homed = {true, false, false};
    run(2);
    EXPECT_EQ(post("jog", R"({"x_mm":1})").status, 202);
    EXPECT_EQ(post("jog", R"({"e_mm":1})").status, 202);
    static_cast<void>(lines());
    const Answer refused = post("jog", R"({"y_mm":1})");
    EXPECT_EQ(refused.status, 409);
    EXPECT_THAT(refused.body, HasSubstr("home first"));
    EXPECT_TRUE(lines().empty());
}

TEST_F(MachineApiTest, AFaultThatIsStillThereIsNotCleared) {
    sketch_->status().fault_persists.assign("hot end sensor does not answer");
    sketch_->fault("hot end sensor does not answer");
    run(2);
    const Answer refused = post("clear-fault");
    EXPECT_EQ(refused.status, 409);
    EXPECT_THAT(refused.body, HasSubstr("the fault is still there: hot end sensor does not answer"));
    sketch_->status().fault_persists.clear();
    run(2);
    EXPECT_EQ(post("clear-fault").status, 202);
}

TEST_F(MachineApiTest, WithoutAMachineItSaysSo) {
    layout_->sketch_dead.store(2);
    run(2);
    const auto status = request("GET /api/v1/machine").json();
    EXPECT_EQ(status["state"], "disconnected");
    EXPECT_THAT(status["fault"].get<std::string>(), HasSubstr("hangs"));
    EXPECT_EQ(post("home").status, 503);
    EXPECT_EQ(post("gcode", R"({"line":"M105"})").status, 503);
}

TEST_F(MachineApiTest, HomesTheAxesThatAreNamed) {
    EXPECT_EQ(post("home").status, 202);
    EXPECT_EQ(post("home", R"({"axes":"zx"})").status, 202);
    EXPECT_THAT(lines(), ElementsAre("G28 X Y Z", "G28 Z X"));
    EXPECT_EQ(post("home", R"({"axes":"e"})").status, 400);
    EXPECT_EQ(post("home", R"({"axes":""})").status, 400);
    EXPECT_EQ(post("home", R"({"axes":7})").status, 400);
    EXPECT_EQ(post("home", R"({"axes":"x\nM104 S300"})").status, 400);
}

TEST_F(MachineApiTest, JogsRelativelyAndWithinTheAxisSpeed) {
    EXPECT_EQ(post("jog", R"({"x_mm":10,"speed_mm_s":50})").status, 202);
    EXPECT_THAT(lines(), ElementsAre("M83", "G91", "G1 X10.0000 F3000.0000", "G90", "M82"));
    EXPECT_EQ(post("jog", R"({"z_mm":-0.1,"speed_mm_s":500})").status, 202);
    EXPECT_THAT(lines(), ::testing::Contains("G1 Z-0.1000 F300.0000"));
    for (const char* bad : {"{}", "", R"({"x_mm":"10"})", R"({"x_mm":null})", R"({"q_mm":1})"}) {
        EXPECT_EQ(post("jog", bad).status, 400) << bad;
    }
    EXPECT_EQ(post("jog", R"({"x_mm":1e9})").status, 422);
    EXPECT_EQ(post("jog", R"({"x_mm":1,"speed_mm_s":0})").status, 422);
    EXPECT_TRUE(lines().empty());
}

TEST_F(MachineApiTest, TemperaturesAndFanHaveTheirLimits) {
    EXPECT_EQ(post("temperature", R"({"hot_end_c":200,"bed_c":60})").status, 202);
    EXPECT_EQ(post("fan", R"({"duty":0.5})").status, 202);
    EXPECT_THAT(lines(), ElementsAre("M104 S200.0000", "M140 S60.0000", "M106 S127.5000"));
    EXPECT_EQ(post("temperature", R"({"hot_end_c":999})").status, 422);
    EXPECT_EQ(post("temperature", R"({"hot_end_c":-1})").status, 422);
    EXPECT_EQ(post("temperature", R"({"bed_c":111})").status, 422);
    EXPECT_EQ(post("temperature", R"({"hot_end_c":200,"bed_c":111})").status, 422) << "all or nothing";
    EXPECT_EQ(post("temperature", "{}").status, 400);
    EXPECT_EQ(post("fan", R"({"duty":1.1})").status, 422);
    EXPECT_EQ(post("fan", R"({"duty":"x"})").status, 400);
    EXPECT_TRUE(lines().empty());
}

TEST_F(MachineApiTest, SendsOneLineOfGcode) {
    EXPECT_EQ(post("gcode", R"({"line":"M105"})").status, 202);
    EXPECT_THAT(lines(), ElementsAre("M105"));
    EXPECT_EQ(post("gcode", R"({"line":"M105\nM104 S999"})").status, 400);
    EXPECT_EQ(post("gcode", R"({"line":""})").status, 400);
    EXPECT_EQ(post("gcode", R"({"line":7})").status, 400);
    EXPECT_TRUE(lines().empty());
}

TEST_F(MachineApiTest, NothingMovesByHandWhileAJobPrints) {
    static_cast<void>(upload("a", spool::content_of(500'000, 1), {{"print", "true"}}));
    run(3, 1000);
    EXPECT_EQ(post("home").status, 409);
    EXPECT_EQ(post("jog", R"({"x_mm":1})").status, 409);
    EXPECT_EQ(post("resume").status, 409);
    EXPECT_EQ(post("clear-fault").status, 409);
}

TEST_F(MachineApiTest, TheEmergencyStopIsServedAtOnce) {
    EXPECT_EQ(post("emergency-stop").status, 202);
    EXPECT_EQ(layout_->emergency.load(), 1u);
    run(2);
    EXPECT_EQ(request("GET /api/v1/machine").json()["state"], "faulted");
    EXPECT_EQ(request("GET /api/v1/machine").json()["fault"], "emergency stop");
    EXPECT_EQ(post("clear-fault").status, 202);
    run(2);
    EXPECT_EQ(request("GET /api/v1/machine").json()["state"], "idle");
}

TEST_F(MachineApiTest, TheGuaranteeIsWhatTheSketchPublishedLast) {
    EXPECT_EQ(request("GET /api/v1/guarantee").status, 503);
    nlohmann::json report = nlohmann::json::parse(
        R"({"board":"linux","loops":[],"cores":[],"bottom_halves":[],"delays":[],"trees":[],)"
        R"("chains":[],"watch_cost_us":null})");
    for (const int strange_threads : {0, 3}) {
        report["strange_threads"] = strange_threads;
        publish(report.dump());
        const Answer answer = request("GET /api/v1/guarantee");
        EXPECT_EQ(answer.status, 200);
        nlohmann::json expected = report;
        expected["service"] = nullptr;
        EXPECT_EQ(answer.json(), expected);
    }
}

TEST_F(MachineApiTest, AGuaranteeThatTheSketchCannotHaveWrittenIsNone) {
    for (const std::string text : {"not json", "[]", "{}", R"({"board":"linux","loops":[{}]})"}) {
        publish(text);
        EXPECT_EQ(request("GET /api/v1/guarantee").status, 503) << text;
    }
    publish(std::string(5000, '[') + std::string(5000, ']'));
    EXPECT_EQ(request("GET /api/v1/guarantee").status, 503) << "deep";
}

TEST_F(MachineApiTest, ConfigAndMetricsAreServed) {
    EXPECT_EQ(request("GET /api/v1/config").json()["name"], "Test printer");
    const Answer metrics = request("GET /metrics");
    EXPECT_THAT(metrics.header("Content-Type"), HasSubstr("text/plain; version=0.0.4"));
    EXPECT_THAT(metrics.body, HasSubstr("qduino_machine_connected 1"));
    EXPECT_THAT(metrics.body, HasSubstr("qduino_jobs{state=\"queued\"} 0"));
    EXPECT_THAT(metrics.body, HasSubstr("qduino_http_requests_total{status=\"2xx\"}"));
}

TEST_F(MachineApiTest, TextFromTheMachineThatIsNoUtf8StillGivesJson) {
    printer::link::JobStatus status = sketch_->status();
    status.message = "\xff\xfe<b>";
    sketch_.reset();
    layout_->job_status.write(status);
    run(1);
    EXPECT_FALSE(request("GET /api/v1/machine").json().is_discarded());
}

}  // namespace
}  // namespace qduino::web::machine_api_test
