#include "board/linux/kernel/memory_folder.h"
#include "board/linux/kernel/run_lock.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "posix/guarded_file.h"
#include "posix/small_file.h"
#include "tests/unit/linux/stranger.h"

namespace qduino::board::linux::memory_folder_test {
namespace {

namespace fs = std::filesystem;
using qduino::test::kStranger;
using qduino::test::Stranger;
using qduino::test::why_no_stranger;
using ::testing::HasSubstr;

class MemoryFolderTest : public ::testing::Test {
  protected:
    MemoryFolderTest() { fs::create_directories(parent_); }
    ~MemoryFolderTest() override { fs::remove_all(parent_); }

    [[nodiscard]] std::size_t entries() const {
        return static_cast<std::size_t>(
            std::distance(fs::directory_iterator{parent_}, fs::directory_iterator{}));
    }
    /// A folder whose maker died without a word.
    void leave_one_behind() const {
        const pid_t child = ::fork();
        if (child == 0) {
            auto made = MemoryFolder::make(parent_);
            if (made) std::ofstream{made->file("pins")} << "edges";
            ::_exit(0);
        }
        ::waitpid(child, nullptr, 0);
    }

    const fs::path parent_ = fs::path{::testing::TempDir()} / ("memory-folder-" + std::to_string(::getpid()));
};

TEST_F(MemoryFolderTest, GoesWithItsOwner) {
    {
        auto made = MemoryFolder::make(parent_);
        ASSERT_TRUE(made);
        std::ofstream{made->file("link")} << "x";
        EXPECT_EQ(entries(), 1U);
    }
    EXPECT_EQ(entries(), 0U);
}

TEST_F(MemoryFolderTest, WhatAKilledPrinterLeftIsRemovedAndWhatLivesIsNot) {
    leave_one_behind();
    leave_one_behind();
    auto living = MemoryFolder::make(parent_);
    ASSERT_TRUE(living);
    std::ofstream{parent_ / "others.file"} << "x";
    EXPECT_EQ(entries(), 4U);
    EXPECT_EQ(MemoryFolder::sweep(parent_), 2);
    EXPECT_EQ(entries(), 2U);
    EXPECT_EQ(MemoryFolder::sweep(parent_), 0);
}

TEST_F(MemoryFolderTest, AChildThatOutlivesItsLauncherKeepsTheFolder) {
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    pid_t heir = 0;
    const pid_t launcher = ::fork();
    if (launcher == 0) {
        const auto made = MemoryFolder::make(parent_);
        const pid_t child = ::fork();
        if (child == 0) {
            ::pause();
            ::_exit(0);
        }
        const bool told = ::write(ends[1], &child, sizeof child) == sizeof child;
        ::_exit(told ? 0 : 1);
    }
    ::waitpid(launcher, nullptr, 0);
    ASSERT_EQ(::read(ends[0], &heir, sizeof heir), static_cast<ssize_t>(sizeof heir));
    EXPECT_EQ(MemoryFolder::sweep(parent_), 0);
    ::kill(heir, SIGKILL);
    // Another's child: gone once the kernel has closed its files.
    for (int i = 0; i < 500 && entries() > 0; ++i) {
        MemoryFolder::sweep(parent_);
        ::usleep(10'000);
    }
    EXPECT_EQ(entries(), 0U);
    ::close(ends[0]);
    ::close(ends[1]);
}

TEST_F(MemoryFolderTest, TheServicesGroupGoesThroughItAndChangesNothing) {
    if (!why_no_stranger().empty()) GTEST_SKIP() << why_no_stranger();
    const auto folder = MemoryFolder::make(parent_, kStranger);
    ASSERT_TRUE(folder);
    const std::string given = folder->file("given"), kept = folder->file("kept");
    ASSERT_TRUE(posix::replace_guarded(given, "for all", 0644));
    ASSERT_TRUE(posix::replace_guarded(kept, "root's", 0600));
    ::chmod(parent_.c_str(), 0755);
    const Stranger service{[&] {
        const bool reads = posix::read_guarded(given, 100).ok();
        const bool reads_roots = posix::read_guarded(kept, 100).ok();
        const bool makes = posix::make_guarded(folder->file("planted"), 0600).ok();
        const bool removes = ::unlink(given.c_str()) == 0 || ::rename(given.c_str(), kept.c_str()) == 0;
        const bool cuts = ::truncate(given.c_str(), 0) == 0;
        return reads && !reads_roots && !makes && !removes && !cuts;
    }};
    EXPECT_TRUE(service.succeeded());
}

TEST_F(MemoryFolderTest, WhatAStrangerCallsSoIsLeftAlone) {
    if (!why_no_stranger().empty()) GTEST_SKIP() << why_no_stranger();
    ::chmod(parent_.c_str(), 01777);
    const fs::path his = parent_ / "qduinomc.abcdef", link = parent_ / "qduinomc.ghijkl";
    fs::create_directory(parent_ / "precious");
    ASSERT_TRUE(posix::write_file(parent_ / "precious" / "lock", "root's"));
    const Stranger attacker{[&] {
        return ::mkdir(his.c_str(), 0755) == 0 && posix::make_guarded(his / "lock", 0644).ok() &&
               ::symlink((parent_ / "precious").c_str(), link.c_str()) == 0;
    }};
    ASSERT_TRUE(attacker.succeeded());
    EXPECT_EQ(MemoryFolder::sweep(parent_), 0);
    EXPECT_TRUE(fs::exists(parent_ / "precious" / "lock"));
}

TEST_F(MemoryFolderTest, ASecondLockNamesTheHolder) {
    const fs::path file = parent_ / "run.lock";
    auto mine = lock_file(file, Nanoseconds{0});
    ASSERT_TRUE(mine);
    const pid_t other = ::fork();
    if (other == 0) {
        ::pause();
        ::_exit(0);
    }
    const auto second = lock_file(file, 100ms);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, ErrorCode::already_exists);
    EXPECT_THAT(std::string{second.error().message.view()}, HasSubstr("(" + std::to_string(other) + ")"));
    ::kill(other, SIGKILL);
    ::waitpid(other, nullptr, 0);
}

}  // namespace
}  // namespace qduino::board::linux::memory_folder_test
