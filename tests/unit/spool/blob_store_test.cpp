// Files of jobs: whole or absent, named by the server, swept when nobody wants them.
#include "spool/blob_store.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

namespace qduino::spool {
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
    std::ofstream{file->layers_path()} << "layers";
    ASSERT_TRUE(store->adopt(*file, "[1]", "png").ok());
    const std::string name = file->sha256();
    file.reset();
    EXPECT_EQ(std::filesystem::file_size(store->path(name, BlobPart::gcode)), 3u);
    EXPECT_EQ(std::filesystem::file_size(store->path(name, BlobPart::layers)), 6u);
    EXPECT_EQ(std::filesystem::file_size(store->path(name, BlobPart::layers_index)), 3u);
    EXPECT_EQ(std::filesystem::file_size(store->path(name, BlobPart::thumbnail)), 3u);
    struct stat found {};
    ASSERT_EQ(::stat(store->path(name, BlobPart::gcode).c_str(), &found), 0);
    EXPECT_EQ(found.st_mode & 0777, 0600u);
    store->remove(name);
    EXPECT_EQ(files(), 0u);
}

TEST_F(BlobStoreTest, TheSameBytesTwiceAreOneBlob) {
    auto store = open();
    for (int i = 0; i < 2; ++i) {
        auto file = store->stage().value();
        ASSERT_TRUE(file->write(std::string_view{"abc"}).ok());
        ASSERT_TRUE(file->seal().ok());
        ASSERT_TRUE(store->adopt(*file, "", "").ok());
    }
    EXPECT_EQ(files(), 1u);
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

TEST_F(BlobStoreTest, WhatAKilledServiceLeftIsSwept) {
    auto store = open();
    std::ofstream{folder_ / "incoming" / "half"} << "x";
    std::ofstream{folder_ / "blobs" / "aa.gcode"} << "x";
    std::ofstream{folder_ / "blobs" / "bb.gcode"} << "x";
    std::ofstream{folder_ / "blobs" / "bb.png.part"} << "x";
    store = open();
    store->sweep({"bb"});
    EXPECT_EQ(files(), 1u);
    EXPECT_TRUE(std::filesystem::exists(folder_ / "blobs" / "bb.gcode"));
}

}  // namespace
}  // namespace qduino::spool
