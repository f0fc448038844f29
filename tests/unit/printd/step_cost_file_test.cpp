// What a step costs comes from the sketch, outlives the service, and judges the next job.
#include "apps/printd/step_cost_file.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <fstream>
#include <memory>

#include "posix/file_bytes.h"

namespace qduino::printd::step_cost_file_test {
namespace {

using Verdict = spool::Analysis::Verdict;
using ::testing::HasSubstr;

class StepCostFileTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = (std::filesystem::temp_directory_path() / "step-cost-XXXXXX").string();
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }
    spool::Analysis judge(analysis::PreflightAnalyzer& analyzer) {
        const BytesInMemory job{
            std::make_shared<const std::string>("G28\nG1 X1 Y1 F600\nG1 X100 Y100 F60000\n")};
        posix::FileSink layers{folder_ / "layers"};
        return *analyzer.analyze(job, layers);
    }

    std::filesystem::path folder_;
    printer::MachineConfig machine_;
    std::unique_ptr<printer::link::LinkLayout> link_ = std::make_unique<printer::link::LinkLayout>();
};

TEST_F(StepCostFileTest, WhatTheSketchMeasuredJudgesTheNextJobAlsoAfterANewStart) {
    analysis::PreflightAnalyzer analyzer{machine_};
    StepCostFile file{folder_, analyzer};
    EXPECT_EQ(judge(analyzer).verdict, Verdict::fits);
    EXPECT_FALSE(file.take(nullptr));
    EXPECT_FALSE(file.take(link_.get())) << "not measured yet";
    link_->step_cost_ns = 40'000;
    EXPECT_TRUE(file.take(link_.get()));
    EXPECT_FALSE(file.take(link_.get())) << "no news";
    const spool::Analysis refused = judge(analyzer);
    EXPECT_EQ(refused.verdict, Verdict::violation);
    EXPECT_EQ(refused.line, 3u);
    EXPECT_THAT(refused.message, HasSubstr("20000 steps/s; this computer plays at most 17500"));

    analysis::PreflightAnalyzer later{machine_};
    const StepCostFile again{folder_, later};
    EXPECT_EQ(judge(later).verdict, Verdict::violation);
}

TEST_F(StepCostFileTest, NonsenseFromTheOtherSideOrFromTheFileIsNotTaken) {
    analysis::PreflightAnalyzer analyzer{machine_};
    StepCostFile file{folder_, analyzer};
    for (const std::int64_t ns : {std::int64_t{-1}, std::int64_t{1'000'001}, INT64_MIN, INT64_MAX}) {
        link_->step_cost_ns = ns;
        EXPECT_FALSE(file.take(link_.get()));
    }
    std::ofstream{folder_ / "step-cost-ns"} << "99999999999999999999 never";
    const StepCostFile damaged{folder_, analyzer};
    EXPECT_EQ(analyzer.step_cost(), Nanoseconds{0});
}

}  // namespace
}  // namespace qduino::printd::step_cost_file_test
