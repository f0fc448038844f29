// The owner of a closed folder makes and removes folders in it, without the right to pass over all
// permissions, and leaves it as closed as it was.
#include "board/linux/kernel/closed_folder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

#include "tests/unit/linux/stranger.h"

namespace qduino::board::linux::test::closed_folder_test {
namespace {

namespace fs = std::filesystem;

/// A folder with one in it, both closed, of a user without rights: this process's own, or as root
/// the stranger's.
class ClosedFolder : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string name = ::testing::TempDir() + "closed.XXXXXX";
        top_ = ::mkdtemp(name.data());
        ASSERT_EQ(::chmod(top_.c_str(), 0755), 0);
        fs::create_directory(closed_ = top_ / "closed");
        const uid_t owner = ::geteuid() == 0 ? qduino::test::kStranger : ::geteuid();
        ASSERT_EQ(::chown(closed_.c_str(), owner, ::getegid()), 0);
        ASSERT_EQ(::chmod(closed_.c_str(), 0555), 0);
    }
    void TearDown() override {
        ::chmod(closed_.c_str(), 0755);
        fs::remove_all(top_);
    }
    /// What `attempt` returns to a process that is the folder's owner and has no other right.
    template <typename Attempt>
    static bool by_owner(Attempt attempt) {
        if (::geteuid() != 0) return attempt();
        return qduino::test::Stranger{attempt}.succeeded();
    }
    [[nodiscard]] unsigned mode() const {
        struct stat found {};
        return ::stat(closed_.c_str(), &found) == 0 ? found.st_mode & 07777U : 0;
    }

    fs::path top_, closed_;
};

TEST_F(ClosedFolder, ItsOwnerMakesAndRemovesFoldersAndLeavesItClosed) {
    const std::string group = closed_ / "group";
    ASSERT_FALSE(by_owner([&] { return ::mkdir(group.c_str(), 0755) == 0; })) << "it is closed";
    EXPECT_TRUE(by_owner([&] { return takes_folders(closed_); }));
    EXPECT_TRUE(by_owner([&] { return make_folder_in_closed(group).ok(); }));
    EXPECT_TRUE(fs::is_directory(group));
    EXPECT_EQ(mode(), 0555U);
    EXPECT_TRUE(
        by_owner([&] { return make_folder_in_closed(group).error().code == ErrorCode::already_exists; }));
    EXPECT_TRUE(by_owner([&] { return remove_folder_in_closed(group).ok(); }));
    EXPECT_FALSE(fs::exists(group));
    EXPECT_EQ(mode(), 0555U);
    EXPECT_TRUE(
        by_owner([&] { return remove_folder_in_closed(group).error().code == ErrorCode::not_found; }));
}

TEST_F(ClosedFolder, OneThatIsOpenIsNotClosed) {
    ASSERT_EQ(::chmod(closed_.c_str(), 0755), 0);
    EXPECT_TRUE(by_owner([&] { return make_folder_in_closed(closed_ / "group").ok(); }));
    EXPECT_EQ(mode(), 0755U);
}

TEST_F(ClosedFolder, AnothersStaysClosed) {
    if (::geteuid() != 0) GTEST_SKIP() << "only root has another user's folder: run this test as root";
    ASSERT_EQ(::chown(closed_.c_str(), 0, 0), 0);
    EXPECT_FALSE(by_owner([&] { return takes_folders(closed_); }));
    EXPECT_FALSE(by_owner([&] { return make_folder_in_closed(closed_ / "group").ok(); }));
    EXPECT_EQ(mode(), 0555U);
}

}  // namespace
}  // namespace qduino::board::linux::test::closed_folder_test
