#include "qduino/build/prepared_headers.h"

#include <gtest/gtest.h>
#include <sys/file.h>

#include "qduino/common/build_step.h"
#include "tests/unit/qduino/temporary_folder.h"

namespace qduino::apps::prepared_headers_test {
namespace {

namespace fs = std::filesystem;

/// A compiler that writes "read" into what it is asked for, and counts its runs.
constexpr const char* kCompiler = R"sh(#!/bin/sh
echo run >> "$(dirname "$0")/runs"
for word; do
  [ "$before" = -MF ] && echo "it: $(dirname "$0")/Arduino.h $(dirname "$0")/other.h" > "$word"
  [ "$before" = -o ] && echo read > "$word"
  before=$word
done
exit "$(cat "$(dirname "$0")/status")"
)sh";

class PreparedHeadersTest : public TemporaryFolder {
  protected:
    void SetUp() override {
        TemporaryFolder::SetUp();
        const fs::path compiler = write("compiler", kCompiler);
        fs::permissions(compiler, fs::perms::owner_all);
        header_ = write("Arduino.h", "");
        other_ = write("other.h", "");
        write("status", "0");
        // Files count as changed when they are as old as what was made of them.
        for (const fs::path& file : {header_, other_}) age(file);
        sdk_.file = folder_ / "qduino-sdk.json";
        sdk_.include = {(folder_ / "elsewhere").string(), folder_.string()};
    }
    static void age(const fs::path& file) {
        fs::last_write_time(file, fs::file_time_type::clock::now() - std::chrono::seconds{10});
    }
    [[nodiscard]] PreparedHeaders headers(const std::string& flag = "-O2") const {
        return {sdk_, {(folder_ / "compiler").string(), flag}, folder_ / "cache"};
    }
    [[nodiscard]] std::size_t runs() const { return text_of(folder_ / "runs").size() / 4; }

    Sdk sdk_;
    fs::path header_, other_;
};

TEST_F(PreparedHeadersTest, AreMadeOnceForEachSetOfFlags) {
    EXPECT_TRUE(headers().make(false).valid());
    EXPECT_TRUE(headers().make(false).valid());
    EXPECT_EQ(runs(), 1u);
    EXPECT_EQ(text_of(headers().folder() / "Arduino.h.gch"), "read\n");
    EXPECT_EQ(headers().folder().parent_path(), folder_ / "headers");
    EXPECT_NE(headers("-O0").folder(), headers().folder());
    EXPECT_TRUE(headers("-O0").make(false).valid());
    EXPECT_EQ(runs(), 2u);
}

TEST_F(PreparedHeadersTest, AreMadeAgainWhenAHeaderBehindThemHasChanged) {
    EXPECT_TRUE(headers().make(false).valid());
    fs::last_write_time(other_, fs::file_time_type::clock::now() + std::chrono::seconds{1});
    EXPECT_TRUE(headers().make(false).valid());
    EXPECT_EQ(runs(), 2u);
}

TEST_F(PreparedHeadersTest, ACompilerThatRefusesLeavesNone) {
    write("status", "1");
    EXPECT_TRUE(headers().make(false).valid());
    EXPECT_FALSE(fs::exists(headers().folder() / "Arduino.h.gch"));
}

TEST_F(PreparedHeadersTest, WithoutTheHeaderThereIsNothingToMake) {
    sdk_.include = {(folder_ / "elsewhere").string()};
    EXPECT_FALSE(headers().make(false).valid());
    EXPECT_EQ(runs(), 0u);
}

TEST_F(PreparedHeadersTest, MayBeUsedByManyAndChangedByNobodyMeanwhile) {
    const posix::UniqueFd one = headers().make(false);
    const posix::UniqueFd other{::open((headers().folder() / ".lock").c_str(), O_RDWR | O_CLOEXEC)};
    EXPECT_NE(::flock(other.get(), LOCK_EX | LOCK_NB), 0);
    EXPECT_EQ(::flock(other.get(), LOCK_SH | LOCK_NB), 0);
}

}  // namespace
}  // namespace qduino::apps::prepared_headers_test
