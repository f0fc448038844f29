// A serial host and the queue exclude each other, in words, and also through the death of the
// service.
#include <gmock/gmock.h>

#include "tests/unit/spool/spool_fixture.h"

namespace qduino::spool::host_test {
namespace {

using testing::HasSubstr;

class SpoolHost : public SpoolTest {
  protected:
    void SetUp() override {
        SpoolTest::SetUp();
        start_sketch();
        open_spool();
        run(3);
    }
    [[nodiscard]] std::string refusal(const Result<void>& result) {
        return result.ok() ? "" : std::string{result.error().message.view()};
    }
};

TEST_F(SpoolHost, WhileAJobIsPrintedAHostMayAskAndNotMove) {
    const JobId job = *add(content_of(3'000'000, 4));
    run(3, 1000);
    ASSERT_EQ(state(job), JobState::printing);
    EXPECT_TRUE(spool_->host_line("M114", HostClaim::none).ok());
    EXPECT_THAT(refusal(spool_->host_line("G28", HostClaim::printer)),
                HasSubstr("the printer is printing job 1 (test.gcode)"));
}

TEST_F(SpoolHost, WhileAHostHasThePrinterNothingElseBegins) {
    ASSERT_TRUE(spool_->host_line("M105", HostClaim::none).ok());
    EXPECT_EQ(spool_->gate().hold_reason, "") << "a question takes nothing";
    ASSERT_TRUE(spool_->host_line("G28", HostClaim::printer).ok());
    const JobId job = *add("G28\n");
    run(20);
    EXPECT_EQ(state(job), JobState::queued);
    EXPECT_EQ(spool_->gate().hold_reason, "a serial host has the printer");
    EXPECT_THAT(refusal(spool_->release_queue()), HasSubstr("disconnect it first"));
    EXPECT_THAT(refusal(spool_->gcode(std::vector<std::string>{"G1 X1"})), HasSubstr("would mix"));
    spool_->host_leaves();
    run(20);
    EXPECT_EQ(state(job), JobState::queued) << "without a question about the bed, somebody must look";
    EXPECT_EQ(spool_->gate().hold_reason, "a serial host has used the printer");
    ASSERT_TRUE(spool_->release_queue().ok());
    run(20);
    EXPECT_EQ(state(job), JobState::done);
}

TEST_F(SpoolHost, AfterAHostTheBedMustBeCleared) {
    options_.confirm_bed = true;
    open_spool();
    run(3);
    ASSERT_TRUE(spool_->host_line("G28", HostClaim::printer).ok());
    spool_->host_leaves();
    EXPECT_EQ(spool_->gate().hold_reason, "");
    EXPECT_TRUE(spool_->gate().bed_occupied);
}

TEST_F(SpoolHost, AServiceThatDiesMeanwhileBeginsNothing) {
    ASSERT_TRUE(spool_->host_line("G28", HostClaim::printer).ok());
    open_spool();
    const JobId job = *add("G28\n");
    run(20);
    EXPECT_EQ(state(job), JobState::queued);
    EXPECT_EQ(spool_->gate().hold_reason, "a serial host has the printer");
    EXPECT_TRUE(spool_->release_queue().ok()) << "there is no host now";
}

TEST_F(SpoolHost, ANewSketchHasNoHost) {
    ASSERT_TRUE(spool_->host_line("G28", HostClaim::printer).ok());
    start_sketch();
    run(3);
    EXPECT_EQ(spool_->gate().hold_reason, "a serial host has used the printer");
}

TEST_F(SpoolHost, ItsAnswersGoToItAlone) {
    using printer::link::ReplyKind;
    const auto say = [&](ReplyKind kind, const char* text) {
        ASSERT_TRUE(try_push(layout_->replies, printer::link::encode(printer::link::ReplyText{kind, text})));
    };
    say(ReplyKind::host_error, "to the host");
    say(ReplyKind::error, "to the page");
    run(1);
    const auto host = spool_->take_host_replies(), page = spool_->take_replies();
    ASSERT_EQ(host.size(), 1u);
    EXPECT_EQ(host[0].text, "to the host");
    ASSERT_EQ(page.size(), 1u);
    EXPECT_EQ(page[0].text, "to the page");
}

}  // namespace
}  // namespace qduino::spool::host_test
