// The journal, beyond what every store promises (storage_contract_test.cpp).
#include "spool/disk/sqlite_store.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>

namespace qduino::spool::store_test {
namespace {

class StoreTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = (std::filesystem::temp_directory_path() / "store-XXXXXX").string();
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
        reopen();
    }
    void TearDown() override {
        store_.reset();
        std::filesystem::remove_all(folder_);
    }
    void reopen() {
        store_.reset();
        auto opened = SqliteStore::open(folder_ / "journal.sqlite");
        ASSERT_TRUE(opened.ok()) << opened.error().message.view();
        store_ = std::move(*opened);
    }

    std::filesystem::path folder_;
    std::unique_ptr<SqliteStore> store_;
};

/// The largest file that this process can write, for a while.
class Room {
  public:
    explicit Room(std::uintmax_t bytes) {
        std::signal(SIGXFSZ, SIG_IGN);  // write(2) then fails
        ::getrlimit(RLIMIT_FSIZE, &before_);
        const rlimit little{bytes, before_.rlim_max};
        ::setrlimit(RLIMIT_FSIZE, &little);
    }
    ~Room() { more(); }
    Room(const Room&) = delete;
    Room& operator=(const Room&) = delete;
    void more() const { ::setrlimit(RLIMIT_FSIZE, &before_); }

  private:
    rlimit before_{};
};

/// In the log's file a frame more or less has room; each failure is one inside of a transaction.
TEST_F(StoreTest, IsAskedToMakeRoomWhereverACommitFailsForWantOfIt) {
    int asked = 0;
    for (std::uintmax_t bytes = 0; bytes < 3 * 4120; bytes += 500) {
        Commit commit;
        commit.jobs.put.push_back({.id = 1 + static_cast<JobId>(bytes), .name = "a", .facts_json = "{}"});
        const std::uintmax_t log = std::filesystem::file_size(folder_ / "journal.sqlite-wal");
        const Room room{log + bytes % 4120};
        bool was_asked = false;
        store_->when_full([&] {
            was_asked = true;
            room.more();
            return true;
        });
        const auto done = store_->commit(commit);
        EXPECT_TRUE(done.ok()) << bytes << ": " << done.error().message.view();
        asked += was_asked ? 1 : 0;
    }
    EXPECT_GT(asked, 10);
}

TEST_F(StoreTest, AFileThatIsNoJournalIsRefusedWithAReason) {
    std::ofstream{folder_ / "other.sqlite"} << std::string(5000, 'x');
    const auto opened = SqliteStore::open(folder_ / "other.sqlite");
    ASSERT_FALSE(opened.ok());
    EXPECT_EQ(opened.error().code, ErrorCode::corrupt);
}

}  // namespace
}  // namespace qduino::spool::store_test
