// Root gives a state folder away: the one that is the printer's, and no other; whatever stands in
// it.
#include "rights/state_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <functional>

#include "tests/unit/linux/stranger.h"

namespace qduino::rights::state_folder_test {
namespace {

namespace fs = std::filesystem;
using test::kStranger;
using test::why_no_stranger;
using ::testing::HasSubstr;

constexpr uid_t kService = kStranger + 1;

uid_t owner_of(const fs::path& path) {
    struct stat found {};
    return ::lstat(path.c_str(), &found) == 0 ? found.st_uid : static_cast<uid_t>(-1);
}

/// A state folder with what a service has written, and a file of root beside it.
class StateFolder : public ::testing::Test {
  protected:
    void SetUp() override {
        if (!why_no_stranger().empty()) GTEST_SKIP() << why_no_stranger();
        std::string name = ::testing::TempDir() + "state.XXXXXX";
        top_ = ::mkdtemp(name.data());
        fs::create_directories(state_ = top_ / "state");
        fs::create_directories(state_ / "blobs" / "ab");
        for (const char* file : {"journal.sqlite", "journal.sqlite-wal", "api-key", "blobs/ab/cd.gcode"})
            std::ofstream{state_ / file} << "ours";
        std::ofstream{precious_ = top_ / "precious"} << "root's";
        const passwd* const nobody = ::getpwnam("nobody");
        nobody_ = nobody ? nobody->pw_uid : kStranger;
    }
    void TearDown() override {
        if (!top_.empty()) fs::remove_all(top_);
    }
    void give_all_to(uid_t user) const {
        for (const auto& entry : fs::recursive_directory_iterator{state_})
            ASSERT_EQ(::lchown(entry.path().c_str(), user, user), 0);
        ASSERT_EQ(::lchown(state_.c_str(), user, user), 0);
    }
    /// The reason for the refusal; empty: it was given away.
    [[nodiscard]] std::string refusal() const {
        const auto done = hand_over_state(state_, kService, kService);
        return done ? "" : std::string{done.error().message.view()};
    }

    fs::path top_, state_, precious_;
    uid_t nobody_ = 0;
};

TEST_F(StateFolder, ANewOneIsTheUsers) {
    fs::remove_all(state_);
    EXPECT_EQ(refusal(), "");
    EXPECT_EQ(owner_of(state_), kService);
    EXPECT_EQ(fs::status(state_).permissions(), fs::perms::owner_all);
}

TEST_F(StateFolder, OneOfRootOrOfNobodyIsTakenOverWhole) {
    for (const uid_t before : {uid_t{0}, nobody_}) {
        give_all_to(before);
        std::ofstream{state_ / "run.lock"};  // root's own, in either
        EXPECT_EQ(refusal(), "");
        EXPECT_EQ(owner_of(state_), kService);
        for (const auto& entry : fs::recursive_directory_iterator{state_})
            EXPECT_EQ(owner_of(entry.path()), kService) << entry.path();
        EXPECT_EQ(refusal(), "") << "and a second time";
        EXPECT_TRUE(fs::exists(state_ / "blobs/ab/cd.gcode"));
    }
}

TEST_F(StateFolder, AnotherUsersIsNot) {
    give_all_to(kStranger);
    EXPECT_THAT(refusal(), HasSubstr("belongs to another user"));
    EXPECT_EQ(owner_of(state_), kStranger);
}

TEST_F(StateFolder, ALinkInItsPlaceIsNotFollowed) {
    fs::create_directory_symlink(state_, top_ / "link");
    const auto done = hand_over_state(top_ / "link", kService, kService);
    ASSERT_FALSE(done);
    EXPECT_EQ(owner_of(state_), 0U);
}

TEST_F(StateFolder, WhatHoldsAnythingButOursStaysAsItWas) {
    using Plant = std::function<void()>;
    const std::pair<const char*, Plant> cases[] = {
        {"shadow is not the printer's", [&] { std::ofstream{state_ / "shadow"} << "root's"; }},
        {"journal.x is neither a plain file", [&] { fs::create_symlink(precious_, state_ / "journal.x"); }},
        {"address is neither a plain file", [&] { ::mkfifo((state_ / "address").c_str(), 0600); }},
        {"cd.x has a second name", [&] { fs::create_hard_link(precious_, state_ / "blobs/ab/cd.x"); }},
        {"lock has a second name", [&] { fs::create_hard_link(precious_, state_ / "lock"); }},
        {"blobs/ab/link is neither", [&] { fs::create_symlink(precious_, state_ / "blobs/ab/link"); }},
    };
    for (const auto& [why, plant] : cases) {
        plant();
        EXPECT_THAT(refusal(), HasSubstr(why));
        EXPECT_EQ(owner_of(precious_), 0U) << why;
        for (const char* ours : {"", "blobs", "journal.sqlite", "blobs/ab/cd.gcode"})
            EXPECT_EQ(owner_of(state_ / ours), 0U) << why << ": " << ours;
        TearDown();
        SetUp();
    }
}

TEST_F(StateFolder, WhatNobodyPlantedThereIsNotGivenAway) {
    for (const char* name : {"journal.x", "run.lock", "blobs/ab/cd.x"}) {
        give_all_to(nobody_);
        fs::create_hard_link(precious_, state_ / name);
        EXPECT_EQ(refusal().empty(), name == std::string_view{"run.lock"}) << name;
        EXPECT_EQ(owner_of(precious_), 0U) << name;
        EXPECT_TRUE(fs::exists(precious_)) << name;
        TearDown();
        SetUp();
    }
}

}  // namespace
}  // namespace qduino::rights::state_folder_test
