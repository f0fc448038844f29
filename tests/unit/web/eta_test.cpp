// The time that a running copy still takes: by its profile, and by what was measured.
#include "web/api/eta.h"

#include <gtest/gtest.h>

namespace qduino::web::eta_test {
namespace {

using api::Executed;
using Json = nlohmann::ordered_json;

/// 100 s of heat, then 1000 s of motion in 1000 bytes: the first half of the bytes takes 100 s, the
/// second 900.
const Json kFacts = Json::parse(
    R"({"profile":{"step_s":100,"bytes":[500,550,600,650,700,750,800,850,900],"heating_s":100,"heated_byte":20}})");

double left_s(const Executed& executed, const Json& facts = kFacts) {
    return api::remaining_s(facts, 1100, 1000, executed);
}

TEST(Eta, BytesCountByTheTimeThatTheyTake) {
    EXPECT_NEAR(left_s({0, 0, 0}), 1100, 1e-9);
    EXPECT_NEAR(left_s({500, 200, 100}), 900, 1e-9) << "half of the bytes, a tenth of the time";
    EXPECT_NEAR(left_s({750, 700, 100}), 400, 1e-9);
    EXPECT_NEAR(left_s({775, 750, 100}), 350, 1e-9) << "between two points";
    EXPECT_NEAR(left_s({1000, 1100, 100}), 0, 1e-9);
}

TEST(Eta, TheShareOfTheTimeIsNotThatOfTheBytes) {
    EXPECT_NEAR(api::share_of_time(200, left_s({500, 200, 100})), 200 / 1100.0, 1e-9) << "half of the bytes";
    EXPECT_EQ(api::share_of_time(0, 0), 0);
    EXPECT_EQ(api::share_of_time(7, 0), 1);
}

TEST(Eta, TheWaitForHeatRunsDownByItself) {
    EXPECT_NEAR(left_s({0, 60, 60}), 1040, 1e-9);
    EXPECT_NEAR(left_s({0, 130, 130}), 1000, 1e-9) << "longer than estimated: nobody knows how long";
    EXPECT_NEAR(left_s({500, 110, 10}), 900, 1e-9)
        << "the bed was still warm; that says nothing of the motion";
}

TEST(Eta, ThePaceIsTheMeasuredOne) {
    EXPECT_NEAR(left_s({750, 100 + 1200, 100}), 400 * (1200.0 + 120) / (600 + 120), 1e-6)
        << "at half the speed";
    EXPECT_LT(left_s({750, 100 + 300, 100}), 400) << "faster than estimated";
    EXPECT_LT(left_s({10, 101, 100}), 1100) << "the first seconds say nothing yet";
    EXPECT_LE(left_s({500, 1e9, 100}), 900 * 5) << "bounded";
}

TEST(Eta, ADwellRunsDownWhileNoByteIsExecuted) {
    const Json dwell = Json::parse(R"({"profile":{"step_s":100,"bytes":[500,500,500,500,1000]}})");
    const auto left = [&](double time_s) { return api::remaining_s(dwell, 500, 1000, {500, time_s, 0}); };
    EXPECT_NEAR(left(100), 400, 1e-9);
    EXPECT_NEAR(left(250), 250, 1e-9);
    EXPECT_NEAR(left(400), 100, 1e-9);
}

TEST(Eta, WithoutAProfileTheBytesMustDo) {
    EXPECT_NEAR(left_s({250, 275, 0}, Json::object()), 0.75 * 1100, 1e-9);
    for (const char* odd : {"[]", "3", R"({"profile":7})", R"({"profile":{"step_s":"a","bytes":[1,"b",-4]}})",
                            R"({"profile":{"step_s":-1,"bytes":{},"heating_s":-5,"heated_byte":-1}})"}) {
        const double left = left_s({500, 10, 0}, Json::parse(odd));
        EXPECT_TRUE(left >= 0 && left < 6000) << odd;
    }
}

}  // namespace
}  // namespace qduino::web::eta_test
