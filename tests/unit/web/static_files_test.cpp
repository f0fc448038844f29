#include "web/net/static_folder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace qduino::web::static_files_test {
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
        std::ofstream{folder_ / "dist/assets/app.js"} << "javascript";
        std::ofstream{folder_ / "dist/assets/app.js.gz"} << "zipped";
        std::ofstream{folder_ / "dist/assets/app.js.br"} << "brot";
        std::ofstream{folder_ / "dist/assets/small.css"} << "x";
        std::ofstream{folder_ / "dist/assets/small.css.gz"} << "no smaller";
        std::ofstream{folder_ / "dist/notes.gz"} << "a file of its own";
        std::filesystem::create_symlink(folder_ / "secret", folder_ / "dist/link");
        files_ = read_static_folder(folder_ / "dist").value();
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }
    std::optional<Response> get(const std::string& target, std::string etag = "", std::string accepted = "") {
        RequestHead head;
        if (!parse_target(target, head)) return std::nullopt;
        if (!etag.empty()) head.headers.push_back({"If-None-Match", std::move(etag)});
        if (!accepted.empty()) head.headers.push_back({"Accept-Encoding", std::move(accepted)});
        return files_.find(head);
    }
    static std::string header(const std::optional<Response>& response, std::string_view name) {
        for (const Header& header : response->headers) {
            if (header.name == name) return header.value;
        }
        return {};
    }
    std::filesystem::path folder_;
    StaticFiles files_;
};

TEST_F(StaticFilesTest, ServesWhatWasThereAtTheStart) {
    EXPECT_EQ(files_.size(), 4u);
    EXPECT_EQ(*get("/")->shared, "<html>");
    EXPECT_EQ(get("/index.html")->content_type, "text/html; charset=utf-8");
    EXPECT_EQ(*get("/assets/app.js")->shared, "javascript");
}

TEST_F(StaticFilesTest, AThousandAnswersShareOneCopy) {
    const auto first = get("/assets/app.js");
    for (int i = 0; i < 1000; ++i) EXPECT_EQ(get("/assets/app.js")->shared.get(), first->shared.get());
}

TEST_F(StaticFilesTest, TheClientsCodingIsSentWithAnEtagOfItsOwn) {
    const auto plain = get("/assets/app.js");
    const auto gzip = get("/assets/app.js", "", "gzip");
    const auto brotli = get("/assets/app.js", "", "gzip, deflate, br");
    EXPECT_EQ(*gzip->shared, "zipped");
    EXPECT_EQ(*brotli->shared, "brot");
    EXPECT_EQ(header(plain, "Content-Encoding"), "");
    EXPECT_EQ(header(gzip, "Content-Encoding"), "gzip");
    EXPECT_EQ(header(brotli, "Content-Encoding"), "br");
    for (const auto& each : {plain, gzip, brotli}) {
        EXPECT_EQ(each->content_type, "text/javascript; charset=utf-8");
        EXPECT_EQ(header(each, "Vary"), "Accept-Encoding");
        EXPECT_EQ(header(each, "Cache-Control"), "public, max-age=31536000, immutable");
    }
    EXPECT_NE(header(plain, "ETag"), header(gzip, "ETag"));
    EXPECT_NE(header(gzip, "ETag"), header(brotli, "ETag"));
    EXPECT_EQ(get("/assets/app.js", header(gzip, "ETag"), "gzip")->status, 304);
    EXPECT_EQ(get("/assets/app.js", header(gzip, "ETag"), "br")->status, 200)
        << "another's coding is no match";
}

TEST_F(StaticFilesTest, WhatIsNotCodedIsSentAsItIs) {
    const auto page = get("/", "", "gzip, br");
    EXPECT_EQ(*page->shared, "<html>");
    EXPECT_EQ(header(page, "Vary"), "");
    EXPECT_EQ(header(page, "Cache-Control"), "no-cache");
    EXPECT_EQ(*get("/assets/small.css", "", "gzip")->shared, "x");
    EXPECT_EQ(*get("/notes.gz", "", "gzip")->shared, "a file of its own");
    EXPECT_FALSE(get("/assets/app.js.gz").has_value()) << "a coded form has no name of its own";
}

TEST_F(StaticFilesTest, NoPathLeadsOutOfTheList) {
    for (const char* bad :
         {"/../secret", "/%2e%2e/secret", "/..%2fsecret", "/assets/../../secret", "/link", "//etc/passwd",
          "/assets", "/assets/", "/..\\secret", "/%2e%2e%5csecret", "/index.html/", "/./index.html"}) {
        EXPECT_FALSE(get(bad).has_value()) << bad;
    }
}

TEST_F(StaticFilesTest, WhatTheClientHasIsNotSentAgain) {
    const std::string etag = header(get("/"), "ETag");
    ASSERT_FALSE(etag.empty());
    EXPECT_EQ(get("/", etag)->status, 304);
    EXPECT_EQ(get("/", etag)->body_size(), 0u);
    EXPECT_EQ(get("/", "\"other\", W/" + etag)->status, 304);
    EXPECT_EQ(get("/", "\"other\"")->status, 200);
}

TEST_F(StaticFilesTest, AMissingFolderIsSaid) {
    const auto missing = read_static_folder(folder_ / "nothing");
    ASSERT_FALSE(missing.ok());
    EXPECT_EQ(missing.error().code, ErrorCode::not_found);
}

}  // namespace
}  // namespace qduino::web::static_files_test
