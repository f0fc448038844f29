#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <string>
#include <utility>

#include "posix/durable_file.h"
#include "posix/local_socket.h"
#include "posix/mapping.h"
#include "posix/small_file.h"
#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::posix::posix_test {
namespace {

bool is_open(int fd) { return ::fcntl(fd, F_GETFD) >= 0; }

/// A folder of its own for each test.
class Posix : public ::testing::Test {
  protected:
    Posix() {
        std::string name = ::testing::TempDir() + "posix.XXXXXX";
        folder_ = ::mkdtemp(name.data());
    }
    ~Posix() override { std::filesystem::remove_all(folder_); }
    [[nodiscard]] std::string at(const char* name) const { return folder_ / name; }

    std::filesystem::path folder_;
};

TEST_F(Posix, ADescriptorIsClosedOnceByWhoOwnsItLast) {
    std::array<int, 2> ends{};
    ASSERT_EQ(::pipe(ends.data()), 0);
    UniqueFd other{ends[1]};
    {
        UniqueFd first{ends[0]};
        const UniqueFd second = std::move(first);
        EXPECT_FALSE(first.valid());  // NOLINT: the moved-from state is the point
        EXPECT_TRUE(is_open(ends[0]));
    }
    EXPECT_FALSE(is_open(ends[0]));
    other = UniqueFd{};
    EXPECT_FALSE(is_open(ends[1]));
}

TEST_F(Posix, AnErrorNamesTheAttemptTheObjectAndTheReason) {
    const Error error = system_error("open", "/a/file", EACCES);
    EXPECT_EQ(error.code, ErrorCode::not_permitted);
    EXPECT_EQ(error.message.view(), "cannot open /a/file: Permission denied");
    EXPECT_EQ(system_error("write", "x", ENOSPC).code, ErrorCode::unavailable);
    EXPECT_EQ(system_error("write", "x", EIO).code, ErrorCode::internal);
}

TEST_F(Posix, ASmallFileIsReadWholeAndWrittenOnlyWhereThereIsOne) {
    const std::string long_text(10'000, 'x');
    EXPECT_EQ(write_small_file(at("value"), "1").error().code, ErrorCode::not_found);
    ASSERT_TRUE(write_durably(at("value"), long_text).ok());
    EXPECT_EQ(*read_small_file(at("value")), long_text);
    ASSERT_TRUE(write_small_file(at("value"), "1").ok());
    EXPECT_EQ(*read_small_file(at("value")), "1");
}

TEST_F(Posix, ADurableFileIsItsOwnersAloneAndLeavesNothingBesideIt) {
    ASSERT_TRUE(write_durably(at("key"), "secret").ok());
    struct stat found {};
    ASSERT_EQ(::stat(at("key").c_str(), &found), 0);
    EXPECT_EQ(found.st_mode & 0777U, 0600U);
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator{folder_}, {}), 1);
}

TEST_F(Posix, ADurableFileThatCannotBeWrittenLeavesTheOldOne) {
    ASSERT_TRUE(write_durably(at("key"), "old").ok());
    std::filesystem::create_directory(at("key.part"));
    EXPECT_FALSE(write_durably(at("key"), "new").ok());
    EXPECT_EQ(*read_small_file(at("key")), "old");
}

TEST_F(Posix, ARenamedFileHasItsNewNameAlone) {
    ASSERT_TRUE(write_durably(at("a"), "text").ok());
    ASSERT_TRUE(rename_and_sync(at("a"), at("b")).ok());
    EXPECT_EQ(*read_small_file(at("b")), "text");
    EXPECT_EQ(rename_and_sync(at("a"), at("b")).error().code, ErrorCode::not_found);
}

TEST_F(Posix, TwoMappingsOfAFileShareItsBytes) {
    ASSERT_TRUE(write_durably(at("memory"), std::string(4096, '\0')).ok());
    const UniqueFd file{::open(at("memory").c_str(), O_RDWR | O_CLOEXEC)};
    const Result<Mapping> writer = map_shared(file.get(), 0, 4096, false);
    Result<Mapping> reader = map_shared(file.get(), 0, 4096, true);
    ASSERT_TRUE(writer.ok() && reader.ok());
    *writer->as<int>() = 42;
    const Mapping moved = std::move(*reader);
    EXPECT_FALSE(reader->valid());
    EXPECT_EQ(*moved.as<int>(), 42);
}

TEST_F(Posix, AChildWritesIntoMemoryThatItsParentReads) {
    const Result<Mapping> memory = map_anonymous(sizeof(int));
    ASSERT_TRUE(memory.ok());
    const pid_t child = ::fork();
    if (child == 0) {
        *memory->as<int>() = 7;
        ::_exit(0);
    }
    ASSERT_EQ(::waitpid(child, nullptr, 0), child);
    EXPECT_EQ(*memory->as<int>(), 7);
}

TEST_F(Posix, WhatRootMakesInSomebodysFolderBecomesTheirs) {
    if (::geteuid() != 0) GTEST_SKIP() << "root alone can give a file away";
    ASSERT_TRUE(write_durably(at("by-name"), "").ok());
    ASSERT_TRUE(write_durably(at("by-descriptor"), "").ok());
    ASSERT_EQ(::chown(folder_.c_str(), 1234, 4321), 0);
    std::filesystem::create_symlink(at("by-descriptor"), at("link"));
    give_to_owner_of_folder(at("link"));  // a link is given itself, not what it names
    struct stat found {};
    ASSERT_EQ(::stat(at("by-descriptor").c_str(), &found), 0);
    EXPECT_EQ(found.st_uid, 0U);
    give_to_owner_of_folder(at("by-name"));
    const UniqueFd file{::open(at("by-descriptor").c_str(), O_RDONLY | O_CLOEXEC)};
    give_to_owner_of_folder(at("by-descriptor"), file.get());
    for (const char* name : {"by-name", "by-descriptor"}) {
        ASSERT_EQ(::stat(at(name).c_str(), &found), 0);
        EXPECT_EQ(found.st_uid, 1234U) << name;
        EXPECT_EQ(found.st_gid, 4321U) << name;
    }
}

TEST_F(Posix, ALocalSocketConnectsACallerWithItsListener) {
    const auto listener = listen_local(folder_ / "here", 1);
    ASSERT_TRUE(listener);
    const auto caller = connect_local(folder_ / "here");
    ASSERT_TRUE(caller);
    EXPECT_TRUE(UniqueFd{::accept(listener->get(), nullptr, nullptr)}.valid());
}

TEST_F(Posix, ALocalSocketIsOfItsOwnerAlone) {
    const auto listener = listen_local(folder_ / "here", 1);
    struct stat is {};
    ASSERT_EQ(::stat((folder_ / "here").c_str(), &is), 0);
    EXPECT_EQ(is.st_mode & 0777, 0600U);
}

TEST_F(Posix, ALocalSocketTakesThePlaceOfADeadOne) {
    { const auto dead = listen_local(folder_ / "here", 1); }
    EXPECT_FALSE(connect_local(folder_ / "here"));
    const auto listener = listen_local(folder_ / "here", 1);
    EXPECT_TRUE(connect_local(folder_ / "here"));
}

TEST_F(Posix, ALocalSocketsPathThatDoesNotFitIsRefusedWithItsLength) {
    EXPECT_TRUE(local_address(std::string(107, 'x')));
    const auto refused = local_address(std::string(108, 'x'));
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.view().find("not 108"), std::string_view::npos);
    EXPECT_FALSE(local_address(""));
}

}  // namespace
}  // namespace qduino::posix::posix_test
