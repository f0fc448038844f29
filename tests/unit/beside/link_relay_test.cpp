// What the relay carries between a printer's link in the reserved memory and the file that printd
// opens.
#include "beside/link_relay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace qduino::apps::beside_linux::link_relay_test {
namespace {

using printer::link::LinkLayout;

template <typename Status>
Status with_heartbeat(std::uint64_t count) {
    Status status;
    status.heartbeat = count;
    return status;
}

class LinkRelayTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = (std::filesystem::temp_directory_path() / "relay-XXXXXX").string();
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
        relay_ = std::make_unique<LinkRelay>(*board_, folder_ / "link");
    }
    void TearDown() override {
        relay_.reset();
        std::filesystem::remove_all(folder_);
    }

    /// As the image does in setup().
    void image_makes_its_link() {
        board_->version = printer::link::kVersion;
        board_->size = sizeof(LinkLayout);
        board_->session = 77;
        board_->magic.store(printer::link::kMagic);
    }
    [[nodiscard]] LinkFile printd() const {
        auto file = open_link(folder_ / "link");
        EXPECT_TRUE(file.ok()) << (file.ok() ? "" : file.error().message.view());
        return file.ok() ? std::move(*file) : LinkFile{};
    }
    void pass() {
        const Result<void> passed = relay_->pass(now_ += 10ms);
        EXPECT_TRUE(passed.ok());
    }

    std::filesystem::path folder_;
    std::unique_ptr<LinkLayout> board_ = std::make_unique<LinkLayout>();
    std::unique_ptr<LinkRelay> relay_;
    Instant now_ = kEpoch;
};

TEST_F(LinkRelayTest, TheFileIsThereWhenTheImageHasALinkAndIsNewForEachRun) {
    pass();
    EXPECT_FALSE(std::filesystem::exists(folder_ / "link")) << "the image has made none yet";
    image_makes_its_link();
    pass();
    const LinkFile first = printd();
    EXPECT_TRUE(first.is_current(folder_ / "link"));
    relay_.reset();
    EXPECT_EQ(first.get()->sketch_dead.load(), 1u);
    EXPECT_EQ(first.get()->death_note_ready.load(), 1u);
    EXPECT_STREQ(first.get()->death_note.data(), "its run beside Linux has ended");
    relay_ = std::make_unique<LinkRelay>(*board_, folder_ / "link");
    pass();
    EXPECT_FALSE(first.is_current(folder_ / "link"));
}

TEST_F(LinkRelayTest, AnImageOfAnotherVersionIsRefused) {
    image_makes_its_link();
    board_->version += 1;
    EXPECT_EQ(relay_->pass(kEpoch).error().code, ErrorCode::unsupported);
    board_->version -= 1;
    board_->size -= 8;
    EXPECT_EQ(relay_->pass(kEpoch).error().code, ErrorCode::unsupported);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "link"));
}

/// Six megabytes in pieces of any size, through rings of one that are full most of the time: each
/// byte comes once, in order.
TEST_F(LinkRelayTest, NoByteOfAJobIsLostOrComesTwice) {
    image_makes_its_link();
    pass();
    LinkFile service = printd();
    std::mt19937 random{20261124};
    std::vector<std::uint8_t> sent, came;
    std::array<std::uint8_t, 50'000> piece;
    constexpr std::size_t kAll = 6'000'000;
    for (int turns = 0; came.size() < kAll && turns < 5000; ++turns) {
        const std::size_t size = std::min<std::size_t>(random() % piece.size(), kAll - sent.size());
        for (std::size_t i = 0; i < size; ++i) piece[i] = static_cast<std::uint8_t>(random());
        if (service.get()->jobs.try_push_all({piece.data(), size}))
            sent.insert(sent.end(), piece.begin(), piece.begin() + static_cast<std::ptrdiff_t>(size));
        if (random() % 50 == 0) {  // killed, and started again
            service = {};
            service = printd();
        }
        pass();
        if (random() % 4 != 0) continue;
        const std::size_t count = board_->jobs.pop_some({piece.data(), random() % piece.size()});
        came.insert(came.end(), piece.begin(), piece.begin() + static_cast<std::ptrdiff_t>(count));
    }
    EXPECT_EQ(came.size(), kAll);
    EXPECT_TRUE(came == sent);
}

TEST_F(LinkRelayTest, CommandsStopsAndAnswersGoTheirWay) {
    image_makes_its_link();
    pass();
    const LinkFile service = printd();
    service.get()->emergency.store(3);
    service.get()->service_heartbeat.store(5);
    service.get()->service_pid.store(7);
    ASSERT_TRUE(service.get()->commands.try_push(11));
    ASSERT_TRUE(board_->replies.try_push(13));
    board_->step_cost_ns.store(17);
    printer::link::JobStatus job;
    job.heartbeat = 19;
    job.bytes_accepted = 23;
    board_->job_status.write(job);
    board_->motion_status.write(with_heartbeat<printer::link::MotionStatus>(29));
    board_->heat_status.write(with_heartbeat<printer::link::HeatStatus>(31));
    printer::link::KeptHeat kept;
    kept.number = 37;
    board_->kept_heat.write(kept);
    pass();
    EXPECT_EQ(board_->emergency.load(), 3u);
    EXPECT_EQ(board_->service_heartbeat.load(), 5u);
    EXPECT_EQ(board_->service_pid.load(), 7u);
    ASSERT_NE(board_->commands.front(), nullptr);
    EXPECT_EQ(*board_->commands.front(), 11);
    ASSERT_NE(service.get()->replies.front(), nullptr);
    EXPECT_EQ(*service.get()->replies.front(), 13);
    EXPECT_EQ(service.get()->step_cost_ns.load(), 17);
    EXPECT_EQ(service.get()->job_status.read().heartbeat, 19u);
    EXPECT_EQ(service.get()->job_status.read().bytes_accepted, 23u);
    EXPECT_EQ(service.get()->motion_status.read().heartbeat, 29u);
    EXPECT_EQ(service.get()->heat_status.read().heartbeat, 31u);
    EXPECT_EQ(service.get()->kept_heat.read().number, 37u);
}

TEST_F(LinkRelayTest, WithoutAFileNothingIsCarried) {
    image_makes_its_link();
    LinkRelay none{*board_, {}};
    EXPECT_TRUE(none.pass(kEpoch).ok());
    EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

}  // namespace
}  // namespace qduino::apps::beside_linux::link_relay_test
