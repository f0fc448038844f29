// The link's file: complete or absent, new for every run of the sketch, held by one service.
#include "link/link_file.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

namespace qduino::apps::link_file_test {
namespace {

class LinkFileTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = (std::filesystem::temp_directory_path() / "link-XXXXXX").string();
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
        path_ = folder_ / "link";
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }
    std::filesystem::path folder_, path_;
};

TEST_F(LinkFileTest, WhatTheSketchMakesTheServiceOpens) {
    auto sketch = create_link(path_, 1234);
    ASSERT_TRUE(sketch.ok());
    auto service = open_link(path_);
    ASSERT_TRUE(service.ok()) << service.error().message.view();
    EXPECT_NE(service->get()->session, 0u);
    EXPECT_EQ(service->get()->session, sketch->get()->session);
    EXPECT_EQ(service->get()->started_unix_s, 1234u);
    EXPECT_EQ(service->get()->job_status.read().feed_factor, 1)
        << "a slot holds the defaults until it is written";
    ASSERT_TRUE(sketch->get()->jobs.try_push(42));
    EXPECT_EQ(*service->get()->jobs.front(), 42);
}

TEST_F(LinkFileTest, AbsentIsNotFound) {
    const auto service = open_link(path_);
    ASSERT_FALSE(service.ok());
    EXPECT_EQ(service.error().code, ErrorCode::not_found);
}

TEST_F(LinkFileTest, AnythingElseIsRefused) {
    std::ofstream{path_} << "not a link";
    EXPECT_EQ(open_link(path_).error().code, ErrorCode::unsupported);
    std::ofstream{path_} << std::string(sizeof(printer::link::LinkLayout), '\0');
    EXPECT_EQ(open_link(path_).error().code, ErrorCode::corrupt);
    {
        auto sketch = create_link(path_, 1);
        ASSERT_TRUE(sketch.ok());
        sketch->get()->version = 99;
    }
    EXPECT_EQ(open_link(path_).error().code, ErrorCode::unsupported);
}

TEST_F(LinkFileTest, ANewRunOfTheSketchIsNoticedAndNothingStaleIsRead) {
    auto first = create_link(path_, 1);
    auto service = open_link(path_);
    ASSERT_TRUE(service.ok());
    EXPECT_TRUE(service->is_current(path_));
    ASSERT_TRUE(first->get()->jobs.try_push(1));
    auto second = create_link(path_, 2);
    ASSERT_TRUE(second.ok());
    EXPECT_FALSE(service->is_current(path_));
    EXPECT_NE(second->get()->session, first->get()->session);
    auto again = open_link(path_);
    ASSERT_TRUE(again.ok());
    EXPECT_TRUE(again->get()->jobs.empty());
}

TEST_F(LinkFileTest, OneServiceAtATimeAndAKilledOneLetsGo) {
    auto sketch = create_link(path_, 1);
    int ready[2];
    ASSERT_EQ(::pipe(ready), 0);
    const pid_t other = ::fork();
    if (other == 0) {
        const auto held = open_link(path_);
        const char ok = held.ok() ? 1 : 0;
        if (::write(ready[1], &ok, 1) != 1) ::_exit(1);
        ::pause();
        ::_exit(0);
    }
    char ok = 0;
    ASSERT_EQ(::read(ready[0], &ok, 1), 1);
    ASSERT_EQ(ok, 1);
    const auto refused = open_link(path_);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::already_exists);
    ::kill(other, SIGKILL);
    ::waitpid(other, nullptr, 0);
    EXPECT_TRUE(open_link(path_).ok());
    ::close(ready[0]);
    ::close(ready[1]);
}

}  // namespace
}  // namespace qduino::apps::link_file_test
