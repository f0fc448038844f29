// The guarantee report in the link is as of now, for as long as the loops run: in the simulator, to
// the release.
#include "link/live_guarantee.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "board/sim/sim_board.h"

namespace qduino::apps::live_guarantee_test {
namespace {

using nlohmann::json;
using printer::link::LinkLayout;

/// One loop of 2 ms in 10 ms, whose body is a lambda.
class LiveGuaranteeTest : public ::testing::Test {
  protected:
    void SetUp() override { test = this; }
    void begin(std::function<void(int release)> body) {
        body_ = std::move(body);
        table_.loops.push_back({{1, 2ms, 10ms, 0}, &call, "a.ino", 1});
        runtime_ = std::make_unique<runtime::Runtime>(board_);
        ASSERT_TRUE(runtime_->begin(table_));
    }
    static void call() {
        test->body_(++test->release_);
        test->runtime_->wait_for_next_period();
    }
    /// The loop as the service reads it now.
    json loop() { return json::parse(link_->guarantee.read().json.view())["loops"][0]; }

    static inline LiveGuaranteeTest* test = nullptr;
    board::NoPeripherals wires_;
    board::sim::SimBoard board_{board::sim::SimConfig{}, wires_};
    runtime::SketchTable table_;
    std::function<void(int)> body_;
    int release_ = 0;
    std::unique_ptr<runtime::Runtime> runtime_;
    std::unique_ptr<LinkLayout> link_ = std::make_unique<LinkLayout>();
};

TEST_F(LiveGuaranteeTest, WhatIsReadWhileTheLoopsRunIsASecondOldAtMost) {
    std::vector<json> seen;
    begin([&](int release) {
        board_.compute(1ms);
        // Late by 5 ms once; in the 251st to the 300th release it has been published since.
        if (release == 150) board_.sleep_until(board_.now() + 14ms);
        if (release % 100 == 50) seen.push_back(loop());
        if (release == 450) board_.request_stop();
    });
    run_and_publish(*link_, *runtime_);
    ASSERT_EQ(seen.size(), 5U);
    EXPECT_EQ(seen[0]["releases"], 0);
    for (std::size_t i = 1; i < seen.size(); ++i) {
        const int releases = seen[i]["releases"];
        EXPECT_GE(releases, static_cast<int>(100 * i) - 2);
        EXPECT_LE(releases, static_cast<int>(100 * i) + 1);
    }
    EXPECT_EQ(seen[1]["overruns"], 0);
    EXPECT_EQ(seen[2]["overruns"], 1);
    EXPECT_EQ(seen[4]["overruns"], 1);
    EXPECT_EQ(seen[4]["worst_late_us"], 5000);
    EXPECT_EQ(seen[4]["missed"], 0);
}

TEST_F(LiveGuaranteeTest, AReleaseThatDoesNotEndHasMissedItsPeriods) {
    begin([&](int release) {
        if (release == 100) board_.sleep_until(board_.now() + 500ms);
    });
    runtime_->run(kEpoch + 1s);
    publish_guarantee(*link_, *runtime_);
    EXPECT_EQ(loop()["missed"], 0);
    runtime_->run(kEpoch + 1245ms);
    publish_guarantee(*link_, *runtime_);
    EXPECT_EQ(loop()["missed"], 24) << "it is in the 26th period since its release began, at 990 ms";
    EXPECT_EQ(loop()["overruns"], 0) << "which has not ended";
    runtime_->run(kEpoch + 2s);
    publish_guarantee(*link_, *runtime_);
    EXPECT_EQ(loop()["missed"], 0);
    EXPECT_EQ(loop()["overruns"], 1);
    board_.request_stop();
    runtime_->run(kForever);
}

TEST_F(LiveGuaranteeTest, AChainIsThereWithItsBoundAndWhatItHasTakenSoFar) {
    runtime::ChainDeclaration declared{"heating"};
    declared.chain().source = runtime::Chain::Source::read;
    declared.chain().from = "thermistors";
    declared.chain().to = "heaters";
    declared.chain().stages.push_back({.vcpu = 1});
    declared.chain().limits.reaction = 20ms;
    std::vector<json> seen;
    begin([&](int release) {
        board_.compute(release == 350 ? 2ms : 1ms);
        if (release % 100 == 50)
            seen.push_back(json::parse(link_->guarantee.read().json.view())["chains"][0]);
        if (release == 450) board_.request_stop();
    });
    run_and_publish(*link_, *runtime_);
    ASSERT_EQ(seen.size(), 5U);
    EXPECT_EQ(seen[0]["name"], "heating");
    EXPECT_EQ(seen[0]["way"], "thermistors > loop 1 > heaters");
    EXPECT_EQ(seen[0]["reaction_bound_us"], 12000);
    EXPECT_EQ(seen[0]["reaction_limit_us"], 20000);
    EXPECT_EQ(seen[0]["age_bound_us"], 2000);
    EXPECT_TRUE(seen[0]["age_limit_us"].is_null());
    EXPECT_EQ(seen[0]["reactions"], 0);
    EXPECT_TRUE(seen[0]["worst_reaction_us"].is_null());
    EXPECT_EQ(seen[3]["worst_reaction_us"], 11000) << "the long release is still to come";
    EXPECT_GE(seen[3]["reactions"], 298);
    EXPECT_EQ(seen[4]["worst_reaction_us"], 12000);
    EXPECT_EQ(seen[4]["worst_age_us"], 2000);
}

}  // namespace
}  // namespace qduino::apps::live_guarantee_test
