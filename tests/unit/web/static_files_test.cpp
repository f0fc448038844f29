#include "web/static_files.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace qduino::web {
namespace {

class StaticFilesTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = "/tmp/static-XXXXXX";
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
        std::filesystem::create_directories(folder_ / "dist/assets");
        std::ofstream{folder_ / "secret"} << "secret";
        std::ofstream{folder_ / "dist/index.html"} << "<html>";
        std::ofstream{folder_ / "dist/assets/app.js"} << "js";
        std::filesystem::create_symlink(folder_ / "secret", folder_ / "dist/link");
        files_ = StaticFiles::read(folder_ / "dist").value();
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }
    std::optional<Response> get(const std::string& target, std::string etag = "") {
        RequestHead head;
        if (!parse_target(target, head)) return std::nullopt;
        if (!etag.empty()) head.headers.push_back({"If-None-Match", std::move(etag)});
        return files_.find(head);
    }
    std::filesystem::path folder_;
    StaticFiles files_;
};

TEST_F(StaticFilesTest, ServesWhatWasThereAtTheStart) {
    EXPECT_EQ(files_.size(), 2u);
    EXPECT_EQ(get("/")->body, "<html>");
    EXPECT_EQ(get("/index.html")->content_type, "text/html; charset=utf-8");
    EXPECT_EQ(get("/assets/app.js")->body, "js");
}

TEST_F(StaticFilesTest, NoPathLeadsOutOfTheList) {
    for (const char* bad :
         {"/../secret", "/%2e%2e/secret", "/..%2fsecret", "/assets/../../secret", "/link", "//etc/passwd",
          "/assets", "/assets/", "/..\\secret", "/%2e%2e%5csecret", "/index.html/", "/./index.html"}) {
        EXPECT_FALSE(get(bad).has_value()) << bad;
    }
}

TEST_F(StaticFilesTest, WhatTheClientHasIsNotSentAgain) {
    std::string etag;
    const auto first = get("/");
    for (const Header& header : first->headers) {
        if (header.name == "ETag") etag = header.value;
    }
    ASSERT_FALSE(etag.empty());
    EXPECT_EQ(get("/", etag)->status, 304);
    EXPECT_TRUE(get("/", etag)->body.empty());
    EXPECT_EQ(get("/", "\"other\"")->status, 200);
}

TEST_F(StaticFilesTest, AMissingFolderIsSaid) {
    const auto missing = StaticFiles::read(folder_ / "nothing");
    ASSERT_FALSE(missing.ok());
    EXPECT_EQ(missing.error().code, ErrorCode::not_found);
}

}  // namespace
}  // namespace qduino::web
