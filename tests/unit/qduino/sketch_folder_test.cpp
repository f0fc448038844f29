#include "qduino/common/sketch_folder.h"

#include <gtest/gtest.h>

#include "tests/unit/qduino/temporary_folder.h"

namespace qduino::apps::sketch_folder_test {
namespace {

namespace fs = std::filesystem;

class SketchFolderTest : public TemporaryFolder {
  protected:
    static std::vector<std::string> names(const std::vector<fs::path>& paths, const fs::path& folder) {
        std::vector<std::string> names;
        for (const fs::path& path : paths) names.push_back(path.lexically_relative(folder).string());
        return names;
    }
    std::string error_of(const fs::path& argument) {
        const auto found = find_sketch(argument);
        return found ? "" : std::string(found.error().message.view());
    }
    using Names = std::vector<std::string>;
};

TEST_F(SketchFolderTest, AFolderIsASketchWithItsMainTabFirst) {
    for (const char* file : {"blink/alpha.ino", "blink/blink.ino", "blink/old.pde", "blink/b.cpp",
                             "blink/a.c", "blink/h.h", "blink/.hidden.cpp", "blink/src/deep/x.cpp",
                             "blink/src/a.cpp", "blink/fast.S", "blink/data/no.cpp"}) {
        write(file, "");
    }
    const auto found = find_sketch(folder_ / "blink");
    ASSERT_TRUE(found);
    EXPECT_EQ(found->name, "blink");
    EXPECT_EQ(found->folder, folder_ / "blink");
    EXPECT_EQ(names(found->tabs, found->folder), (Names{"blink.ino", "alpha.ino", "old.pde"}));
    EXPECT_EQ(names(found->sources, found->folder),
              (Names{"a.c", "b.cpp", "fast.S", "src/a.cpp", "src/deep/x.cpp"}));
    // The main tab means the same sketch.
    const auto by_tab = find_sketch(folder_ / "blink" / "blink.ino");
    ASSERT_TRUE(by_tab);
    EXPECT_EQ(by_tab->tabs, found->tabs);
    EXPECT_EQ(by_tab->sources, found->sources);
}

TEST_F(SketchFolderTest, AnInoAmongOthersStandsForItself) {
    for (const char* file : {"many/one.ino", "many/two.ino", "many/helper.cpp"}) write(file, "");
    const auto found = find_sketch(folder_ / "many" / "two.ino");
    ASSERT_TRUE(found);
    EXPECT_EQ(found->name, "two");
    EXPECT_EQ(names(found->tabs, found->folder), Names{"two.ino"});
    EXPECT_TRUE(found->sources.empty());
}

TEST_F(SketchFolderTest, AnInoAloneHasWhatStandsBesideIt) {
    for (const char* file : {"work/main.ino", "work/helper.cpp"}) write(file, "");
    const auto found = find_sketch(folder_ / "work" / "main.ino");
    ASSERT_TRUE(found);
    EXPECT_EQ(found->name, "main");
    EXPECT_EQ(names(found->sources, found->folder), Names{"helper.cpp"});
}

TEST_F(SketchFolderTest, WhatIsNoSketchIsNamed) {
    write("empty/readme.md", "");
    EXPECT_NE(error_of(folder_ / "empty").find("no .ino file"), std::string::npos);
    EXPECT_NE(error_of(folder_ / "empty/readme.md").find("neither"), std::string::npos);
    EXPECT_NE(error_of(folder_ / "missing").find("no such sketch"), std::string::npos);
}

TEST_F(SketchFolderTest, ANewSketchIsFoundAndNothingIsOverwritten) {
    const auto made = make_sketch(folder_ / "deep" / "fresh/");
    ASSERT_TRUE(made);
    EXPECT_EQ(*made, folder_ / "deep" / "fresh" / "fresh.ino");
    const auto found = find_sketch(folder_ / "deep" / "fresh");
    ASSERT_TRUE(found);
    EXPECT_EQ(found->name, "fresh");
    const std::string text = read(*made);
    EXPECT_EQ(text.rfind("// fresh: two loops", 0), 0u);
    const auto again = make_sketch(folder_ / "deep" / "fresh");
    ASSERT_FALSE(again);
    EXPECT_EQ(again.error().code, ErrorCode::already_exists);
    EXPECT_EQ(read(*made), text);
    write("file", "kept");
    EXPECT_FALSE(make_sketch(folder_ / "file"));
    EXPECT_EQ(read(folder_ / "file"), "kept");
}

TEST_F(SketchFolderTest, NamesThatMakeTroubleAreRefused) {
    for (const char* name : {"", ".", "..", "a b", "-x", ".x", "a;b", "naïve"}) {
        const auto made = make_sketch(*name ? folder_ / name : fs::path(name));
        ASSERT_FALSE(made) << name;
        EXPECT_NE(made.error().code, ErrorCode::internal) << name;
    }
    EXPECT_TRUE(fs::is_empty(folder_));
}

}  // namespace
}  // namespace qduino::apps::sketch_folder_test
