#include "report/picture/picture_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "posix/small_file.h"

namespace qduino::apps::picture::picture_file_test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// A PATH of one folder, with a converter in it or none.
class PictureFile : public ::testing::Test {
  protected:
    PictureFile() : path_(std::getenv("PATH")) {
        fs::create_directories(folder_);
        ::setenv("PATH", folder_.c_str(), 1);
    }
    ~PictureFile() override {
        ::setenv("PATH", path_.c_str(), 1);
        fs::remove_all(folder_);
    }
    /// A converter that writes its arguments and its input into the file that it is to make.
    void install(int status) {
        const fs::path program = folder_ / "rsvg-convert";
        std::ofstream(program) << "#!/bin/sh\n{ echo \"$1 $2\"; /bin/cat; } > \"$4\"\nexit " << status
                               << "\n";
        ::chmod(program.c_str(), 0755);
    }
    std::string path_;
    fs::path folder_ = fs::temp_directory_path() / ("picture-" + std::to_string(::getpid()));
};

TEST_F(PictureFile, AnSvgIsWrittenAsItIs) {
    const std::string path = folder_ / "a.svg";
    ASSERT_TRUE(write_picture(path, "<svg/>"));
    EXPECT_EQ(*posix::read_small_file(path), "<svg/>");
}

TEST_F(PictureFile, AnyOtherNameIsRefusedWithTheOneToTake) {
    for (const char* name : {"a", "a.jpg", "svg", "a.svg.gz", ""}) {
        const auto checked = check_picture_name(name);
        ASSERT_FALSE(checked) << name;
        EXPECT_THAT(std::string(checked.error().message.view()), HasSubstr("ends in .svg"));
    }
}

TEST_F(PictureFile, APngIsRefusedWhereNothingMakesOne) {
    const auto checked = check_picture_name("a.png");
    ASSERT_FALSE(checked);
    EXPECT_EQ(checked.error().code, ErrorCode::not_found);
    EXPECT_THAT(std::string(checked.error().message.view()), HasSubstr("librsvg2-bin"));
    EXPECT_FALSE(write_picture(folder_ / "a.png", "<svg/>"));
    EXPECT_FALSE(fs::exists(folder_ / "a.png"));
}

TEST_F(PictureFile, APngIsMadeByTheConverterThatIsInstalled) {
    install(0);
    EXPECT_TRUE(check_picture_name("a.png"));
    ASSERT_TRUE(write_picture(folder_ / "a b.png", "<svg/>"));
    EXPECT_EQ(*posix::read_small_file(folder_ / "a b.png"), "--format=png --zoom=2\n<svg/>");
}

TEST_F(PictureFile, AConverterThatFailsIsSaid) {
    install(3);
    const auto written = write_picture(folder_ / "a.png", "<svg/>");
    ASSERT_FALSE(written);
    EXPECT_THAT(std::string(written.error().message.view()), HasSubstr("rsvg-convert could not write"));
}

TEST_F(PictureFile, AFolderThatIsNotThereIsNamed) {
    const auto written = write_picture("/nonexistent/a.svg", "<svg/>");
    ASSERT_FALSE(written);
    EXPECT_THAT(std::string(written.error().message.view()), HasSubstr("/nonexistent/a.svg"));
}

}  // namespace
}  // namespace qduino::apps::picture::picture_file_test
