// What the Arduino IDE's builder is told, and what it reads back.
#include <gtest/gtest.h>

#include "qduino/common/build_step.h"
#include "qduino/ide/ide_platform.h"
#include "qduino/ide/ide_recipe.h"
#include "tests/unit/qduino/temporary_folder.h"

namespace qduino::apps::ide_test {
namespace {

namespace fs = std::filesystem;

class IdeTest : public TemporaryFolder {};

TEST_F(IdeTest, TheBuilderFindsObjectAndSourceInTheFirstTwoLinesOfARule) {
    const std::string rule = depfile_of("/b/a b.o", "/s/a b.cpp", {"/s/a b.cpp", "/h/x y.h", "/h/z.h"});
    EXPECT_EQ(rule, "/b/a\\ b.o: \\\n /s/a\\ b.cpp \\\n /h/x\\ y.h \\\n /h/z.h\n");
    EXPECT_EQ(dependencies_in(rule), (std::vector<fs::path>{"/s/a b.cpp", "/h/x y.h", "/h/z.h"}));
}

TEST_F(IdeTest, AHostIsABoardOfItsOwnThatUploadsThere) {
    const std::string text = boards_text({"pi@printer.local"});
    EXPECT_NE(text.find("here.name=QduinoMC (this computer)\n"), std::string::npos);
    EXPECT_NE(text.find("here.upload.to=\n"), std::string::npos);
    EXPECT_NE(text.find("to_pi_printer_local.name=QduinoMC (pi@printer.local)\n"), std::string::npos);
    EXPECT_NE(text.find("to_pi_printer_local.upload.to=--to pi@printer.local\n"), std::string::npos);
    EXPECT_NE(text.find("to_pi_printer_local.upload_port.board=to_pi_printer_local\n"), std::string::npos);
    // The IDE would use a programmer where there is no protocol.
    EXPECT_NE(text.find("to_pi_printer_local.upload.protocol="), std::string::npos);
}

TEST_F(IdeTest, ThePlatformIsWrittenAnewAndRemovedWithoutATrace) {
    fs::create_directories(folder_ / "hardware" / "other");
    const auto place = install_platform(folder_, "/opt/q d/qduino", {"a@b"});
    ASSERT_TRUE(place);
    const std::string platform = text_of(*place / "platform.txt");
    EXPECT_NE(platform.find("\nqduino=/opt/q d/qduino\n"), std::string::npos);
    EXPECT_NE(platform.find("\"{qduino}\" upload {upload.to} --built"), std::string::npos);
    EXPECT_NE(platform.find("pluggable_discovery.qduino.pattern=\"/opt/q d/qduino\" ide discovery a@b\n"),
              std::string::npos);
    EXPECT_NE(platform.find("pluggable_monitor.pattern.qduino=\"/opt/q d/qduino\" ide monitor\n"),
              std::string::npos);
    EXPECT_NE(platform.find("\ndiscovery.qduino.pattern=\"/opt/q d/qduino\" ide serial a@b\n"),
              std::string::npos);
    EXPECT_TRUE(fs::is_directory(*place / "cores" / "qduino"));
    EXPECT_TRUE(install_platform(folder_, "/elsewhere/qduino", {}));
    EXPECT_EQ(text_of(*place / "platform.txt").find("/opt/q d"), std::string::npos);
    EXPECT_TRUE(remove_platform(folder_));
    EXPECT_FALSE(remove_platform(folder_));
    EXPECT_FALSE(fs::exists(folder_ / "hardware" / "qduino"));
    EXPECT_TRUE(fs::exists(folder_ / "hardware" / "other"));
}

TEST_F(IdeTest, AProjectOfTheBuilderNamesItsSketchAndItsLibraries) {
    write("build/build.options.json", R"({"sketchLocation": "/s/blink/blink.ino",
        "otherLibrariesFolders": "/a,/b", "builtInLibrariesFolders": "/c"})");
    const auto project = read_ide_project(folder_ / "build" / "blink.ino");
    ASSERT_TRUE(project);
    EXPECT_EQ(project->sketch, "/s/blink/blink.ino");
    EXPECT_EQ(project->libraries, "/a:/b:/c");
    write("build/build.options.json", "[]");
    EXPECT_EQ(read_ide_project(folder_ / "build" / "blink.ino").error().code, ErrorCode::corrupt);
    EXPECT_EQ(built_by_ide("/b/blink.ino", BoardKind::linux), "/b/blink-linux");
}

TEST_F(IdeTest, ARecipeWithoutItsWordsSaysWhoWritesThem) {
    EXPECT_TRUE(is_recipe("link"));
    EXPECT_FALSE(is_recipe("install"));
    const auto done = run_recipe({}, "link", {"/b"});
    ASSERT_FALSE(done);
    EXPECT_NE(std::string_view(done.error().message).find("qduino ide install"), std::string_view::npos);
}

}  // namespace
}  // namespace qduino::apps::ide_test
