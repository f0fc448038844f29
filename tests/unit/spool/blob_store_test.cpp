// Files of jobs: whole or absent, named by the server, swept when no job wants them.
#include "spool/disk/blob_store.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

namespace qduino::spool::blob_store_test {
namespace {

class BlobStoreTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = (std::filesystem::temp_directory_path() / "blobs-XXXXXX").string();
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }
    std::unique_ptr<BlobStore> open(BlobLimits limits = {1000, 0}) {
        return BlobStore::open(folder_, limits).value();
    }
    std::size_t files() const {
        std::size_t count = 0;
        for (const auto& entry : std::filesystem::recursive_directory_iterator{folder_}) {
            count += entry.is_regular_file() ? 1 : 0;
        }
        return count;
    }
    std::filesystem::path folder_;
};

TEST_F(BlobStoreTest, AdoptsWhatWasSealed) {
    auto store = open();
    auto file = store->stage().value();
    ASSERT_TRUE(file->write(std::string_view{"abc"}).ok());
    ASSERT_TRUE(file->seal().ok());
    EXPECT_EQ(file->sha256(), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    ASSERT_TRUE(file->layers().write(std::string_view{"layers"}).ok());
    ASSERT_TRUE(store->adopt(*file, {"[1]", "png"}, {7, 100, "a b.gcode"}).ok());
    const std::string name = file->sha256();
    file.reset();
    EXPECT_EQ(std::filesystem::file_size(store->path(name, BlobPart::gcode)), 3u);
    EXPECT_EQ(std::filesystem::file_size(store->path(name, BlobPart::layers)), 6u);
    EXPECT_EQ(std::filesystem::file_size(store->path(name, BlobPart::layers_index)), 3u);
    EXPECT_EQ(std::filesystem::file_size(store->path(name, BlobPart::thumbnail)), 3u);
    EXPECT_TRUE(store->records(name).empty()) << "not confirmed yet";
    store->confirm(name);
    ASSERT_EQ(store->records(name).size(), 1u);
    EXPECT_EQ(store->records(name).front().id, 7);
    EXPECT_EQ(store->records(name).front().uploaded_s, 100);
    EXPECT_EQ(store->records(name).front().name, "a b.gcode");
    struct stat found {};
    ASSERT_EQ(::stat(store->path(name, BlobPart::gcode).c_str(), &found), 0);
    EXPECT_EQ(found.st_mode & 0777, 0600u);
    store->remove(name);
    EXPECT_EQ(files(), 0u);
}

TEST_F(BlobStoreTest, TheSameBytesTwiceAreOneBlob) {
    auto store = open();
    std::string name;
    for (int i = 0; i < 2; ++i) {
        auto file = store->stage().value();
        ASSERT_TRUE(file->write(std::string_view{"abc"}).ok());
        ASSERT_TRUE(file->seal().ok());
        ASSERT_TRUE(store->adopt(*file, {}, {i + 1, 100, "a.gcode"}).ok());
        store->confirm(file->sha256());
        name = file->sha256();
    }
    EXPECT_EQ(files(), 2u) << "the bytes, and who brought them";
    EXPECT_EQ(store->records(name).size(), 2u);
    store->forget(name, 1);
    ASSERT_EQ(store->records(name).size(), 1u);
    EXPECT_EQ(store->records(name).front().id, 2);
}

TEST_F(BlobStoreTest, AnAbandonedUploadLeavesNothing) {
    auto store = open();
    {
        auto file = store->stage().value();
        ASSERT_TRUE(file->write(std::string_view{"abc"}).ok());
        EXPECT_EQ(files(), 1u);
    }
    EXPECT_EQ(files(), 0u);
}

TEST_F(BlobStoreTest, TooLongIsRefusedAtTheLimit) {
    auto store = open();
    auto file = store->stage().value();
    const std::string kilo(1000, 'x');
    ASSERT_TRUE(file->write(kilo).ok());
    const auto refused = file->write(std::string_view{"y"});
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::out_of_range);
}

TEST_F(BlobStoreTest, AFullDiskIsSaidClearly) {
    auto store = open({1000, ~std::uint64_t{0}});  // no disk has so much to spare
    auto file = store->stage().value();
    const auto refused = file->write(std::string_view{"x"});
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::unavailable);
    EXPECT_NE(refused.error().message.view().find("full"), std::string_view::npos);
}

TEST_F(BlobStoreTest, AnUnfinishedUploadIsSweptAtTheStart) {
    auto store = open();
    std::ofstream{folder_ / "incoming" / "half"} << "x";
    std::ofstream{folder_ / "blobs" / "aa.gcode"} << "x";
    store = open();
    EXPECT_EQ(files(), 1u);
}

TEST_F(BlobStoreTest, WhatIsSetAsideKeepsAllItsParts) {
    auto store = open();
    for (const char* name : {"aa.gcode", "aa.layers", "aa.job", "bb.gcode"})
        std::ofstream{folder_ / "blobs" / name} << "1\t2\tn\n";
    ASSERT_TRUE(store->set_aside("aa").ok());
    EXPECT_EQ(files(), 4u);
    EXPECT_EQ(store->all(), std::vector<std::string>{"bb"});
    EXPECT_EQ(store->all_set_aside(), std::vector<std::string>{"aa"});
    EXPECT_EQ(store->find_gcode("aa"), folder_ / "set-aside" / "aa.gcode");
    ASSERT_EQ(store->records("aa").size(), 1u) << "read there, too";
    ASSERT_TRUE(store->adopt_again("aa", folder_ / "none", {}, store->records("aa")).ok());
    EXPECT_EQ(store->all(), (std::vector<std::string>{"aa", "bb"}));
    EXPECT_TRUE(std::filesystem::is_empty(folder_ / "set-aside"));
}

TEST_F(BlobStoreTest, DamagedRecordsAreLeftOut) {
    auto store = open();
    std::ofstream{folder_ / "blobs" / "aa.job"} << "x\ty\tz\n7\t8\tname\twith a tab\n\n-1\t2\tn\n9\n";
    const auto records = store->records("aa");
    ASSERT_EQ(records.size(), 1u);
    EXPECT_EQ(records.front().name, "name\twith a tab");
}

}  // namespace
}  // namespace qduino::spool::blob_store_test
