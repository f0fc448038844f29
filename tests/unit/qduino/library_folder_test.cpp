#include "qduino/library/library_folder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "qduino/library/library_shelf.h"
#include "tests/unit/qduino/temporary_folder.h"

namespace qduino::apps::library_folder_test {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

class LibraryFolderTest : public TemporaryFolder {
  protected:
    /// A library's folder below `place`, with one header and its properties (none: of 1.0).
    fs::path library(const std::string& place, const std::string& header,
                     const std::string& properties = "") {
        if (!properties.empty()) write(place + "/library.properties", properties);
        write(place + "/" + header, "");
        return folder_ / place;
    }
    Names relative(const std::vector<fs::path>& paths) const {
        Names names;
        for (const fs::path& path : paths) names.push_back(path.lexically_relative(folder_).string());
        return names;
    }
    /// The folders of the libraries that a sketch in `sketch` has for `header`, the chosen one
    /// first.
    Names having(const std::string& header, const std::string& sketch, const std::string& libraries = "") {
        fs::create_directories(folder_ / sketch);
        const LibraryShelf shelf({.name = "s", .folder = folder_ / sketch, .tabs = {}, .sources = {}},
                                 libraries, (folder_ / "home").string());
        std::vector<fs::path> folders;
        for (const Library& library : shelf.having(header)) folders.push_back(library.folder);
        return relative(folders);
    }
};

TEST(LibraryFlags, CanLinkAndDoNothingElse) {
    for (const char* flag : {"-lm", "-lrt", "-l_under.score+1", "-Llib/x86", "-pthread"})
        EXPECT_TRUE(is_harmless_flag(flag)) << flag;
    for (const char* flag : {"-fplugin=./evil.so", "-B.", "-Wl,--plugin=./evil.so", "-Wl,-Map=/etc/passwd",
                             "-o/etc/passwd", "@flags", "-specs=evil", "-wrapper", "-fuse-ld=evil", "-l",
                             "-l:evil.so", "-L$(touch)", "evil.o", "-Xlinker"})
        EXPECT_FALSE(is_harmless_flag(flag)) << flag;
}

TEST(LibraryText, ObeysNoTerminal) {
    EXPECT_EQ(without_controls("a\x1b[2Jb\x07\rc\x7f"), "a [2Jb  c ");
    EXPECT_EQ(without_controls("\xc2\x9b"
                               "31m"),
              "  31m")
        << "the same as one character of C1";
    EXPECT_EQ(without_controls("Größe, 温度"), "Größe, 温度");
    EXPECT_EQ(library_properties("name=A\x1b]0;x\x07\n")["name"], "A ]0;x ");
}

TEST_F(LibraryFolderTest, ALibraryOf1_0HasItsFolderAndUtility) {
    for (const char* file :
         {"Old/Old.h", "Old/Old.cpp", "Old/fast.S", "Old/utility/u.c", "Old/utility/deep/no.cpp",
          "Old/examples/Demo/no.cpp", "Old/src/no.cpp", "Old/.hidden.cpp"})
        write(file, "");
    const auto old = read_library(folder_ / "Old");
    ASSERT_TRUE(old);
    EXPECT_EQ(old->name, "Old");
    EXPECT_EQ(relative(old->sources()), (Names{"Old/Old.cpp", "Old/fast.S", "Old/utility/u.c"}));
    EXPECT_EQ(relative(old->include_folders()), (Names{"Old", "Old/utility"}));
    EXPECT_TRUE(old->runs_on("qduino"));
}

TEST_F(LibraryFolderTest, ALibraryOf1_5HasAllBelowSrc) {
    for (const char* file : {"New/src/New.h", "New/src/a.cpp", "New/src/deep/er/b.c", "New/no.cpp",
                             "New/utility/no.c", "New/examples/Demo/no.cpp"})
        write(file, "");
    write("New/library.properties",
          "\xef\xbb\xbfname=A New Library\r\nversion = 1.2.3\n# a comment=x\narchitectures=avr, samd\n"
          "includes=New.h,Other.h\ndepends=Foo (>=1.2), Bar\nldflags=-lm -lrt\nnonsense\n");
    const auto library = read_library(folder_ / "New");
    ASSERT_TRUE(library);
    EXPECT_EQ(library->name, "A New Library");
    EXPECT_EQ(library->version, "1.2.3");
    EXPECT_EQ(relative(library->sources()), (Names{"New/src/a.cpp", "New/src/deep/er/b.c"}));
    EXPECT_EQ(relative(library->include_folders()), Names{"New/src"});
    EXPECT_EQ(library->headers(), (Names{"New.h", "Other.h"}));
    EXPECT_EQ(library->depends, (Names{"Foo", "Bar"}));
    EXPECT_EQ(library->ldflags, (Names{"-lm", "-lrt"}));
    EXPECT_TRUE(library->runs_on("avr"));
    EXPECT_FALSE(library->runs_on("qduino"));
}

TEST_F(LibraryFolderTest, PropertiesWithoutSrcMeanAFlatLibrary) {
    library("Flat", "Flat.h", "name=Flat\narchitectures=*\n");
    write("Flat/utility/u.cpp", "");
    const auto flat = read_library(folder_ / "Flat");
    ASSERT_TRUE(flat);
    EXPECT_FALSE(flat->recursive);
    EXPECT_EQ(relative(flat->sources()), Names{"Flat/utility/u.cpp"});
    EXPECT_TRUE(flat->runs_on("qduino"));
}

TEST_F(LibraryFolderTest, AFolderWithoutHeadersIsNone) {
    write("NotOne/readme.md", "");
    library("One", "One.h");
    EXPECT_FALSE(read_library(folder_ / "NotOne"));
    const std::vector<Library> found = libraries_in(folder_);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].name, "One");
    EXPECT_TRUE(libraries_in(folder_ / "nowhere").empty());
}

TEST_F(LibraryFolderTest, EveryPlaceIsSearched) {
    library("book/blink/libraries/Inner", "Inner.h");
    library("book/libraries/Beside", "Beside.h");
    library("libraries/Above", "Above.h");
    library("named/Named", "Named.h");
    library("home/Arduino/libraries/Mine", "Mine.h");
    const std::string named = (folder_ / "none").string() + ":" + (folder_ / "named").string();
    EXPECT_EQ(having("Inner.h", "book/blink"), Names{"book/blink/libraries/Inner"});
    EXPECT_EQ(having("Beside.h", "book/blink"), Names{"book/libraries/Beside"});
    EXPECT_EQ(having("Above.h", "book/blink"), Names{"libraries/Above"});
    EXPECT_EQ(having("Named.h", "book/blink", named), Names{"named/Named"});
    EXPECT_EQ(having("Mine.h", "book/blink"), Names{"home/Arduino/libraries/Mine"});
    EXPECT_EQ(having("Nobody.h", "book/blink"), Names{});
}

TEST_F(LibraryFolderTest, WhatAnotherUserPutBesideASketchIsNotTaken) {
    if (::geteuid() != 0) GTEST_SKIP() << "only root can give a folder away";
    library("book/libraries/Theirs", "Theirs.h");
    EXPECT_EQ(having("Theirs.h", "book/s"), Names{"book/libraries/Theirs"});
    ASSERT_EQ(::chown((folder_ / "book/libraries").c_str(), 12345, 12345), 0);
    EXPECT_EQ(having("Theirs.h", "book/s"), Names{});
    EXPECT_EQ(having("Theirs.h", "book/s", (folder_ / "book/libraries").string()),
              Names{"book/libraries/Theirs"});
}

TEST_F(LibraryFolderTest, ASketchsOwnLibraryComesBeforeAll) {
    library("book/libraries/Same", "Same.h", "name=Same\narchitectures=qduino\n");
    library("book/blink/libraries/copy", "Same.h", "name=Other\narchitectures=avr\n");
    EXPECT_EQ(having("Same.h", "book/blink"), (Names{"book/blink/libraries/copy", "book/libraries/Same"}));
}

TEST_F(LibraryFolderTest, AnExampleHasTheLibraryAroundIt) {
    library("work/Mine", "Mine.h");
    EXPECT_EQ(having("Mine.h", "work/Mine/examples/Demo"), Names{"work/Mine"});
    // And once, where the library is in a searched place as well.
    library("libraries/Twice", "Twice.h");
    EXPECT_EQ(having("Twice.h", "libraries/Twice/examples/Demo", (folder_ / "libraries").string()),
              Names{"libraries/Twice"});
}

TEST_F(LibraryFolderTest, TheNameThatIsMostLikeTheHeaderIsMeant) {
    // The worst first, so that the order of the alphabet is not what decides.
    library("libraries/AnAwesomeFooForAll", "Foo.h");
    library("libraries/AwesomeFoo", "Foo.h");
    library("libraries/Foo-main", "Foo.h");
    library("libraries/Foo-master", "Foo.h");
    library("libraries/FooWhatever", "Foo.h");
    library("libraries/nothing", "Foo.h");
    library("libraries/zz", "Foo.h", "name=Foo\n");
    library("libraries/Foo", "Foo.h");
    EXPECT_EQ(having("Foo.h", "libraries/../s"),
              (Names{"libraries/Foo", "libraries/zz", "libraries/Foo-main", "libraries/Foo-master",
                     "libraries/FooWhatever", "libraries/AwesomeFoo", "libraries/AnAwesomeFooForAll",
                     "libraries/nothing"}));
}

TEST_F(LibraryFolderTest, OneThatRunsHereComesBeforeAName) {
    library("libraries/Foo", "Foo.h", "name=Foo\narchitectures=avr\n");
    library("libraries/other", "Foo.h", "name=other\narchitectures=*\n");
    library("libraries/qother", "Foo.h", "name=qother\narchitectures=samd,qduino\n");
    EXPECT_EQ(having("Foo.h", "s"), (Names{"libraries/qother", "libraries/other", "libraries/Foo"}));
}

TEST_F(LibraryFolderTest, TheNearerPlaceDecidesLast) {
    library("book/libraries/Foo", "Foo.h");
    library("home/Arduino/libraries/Foo", "Foo.h");
    EXPECT_EQ(having("Foo.h", "book/s"), (Names{"book/libraries/Foo", "home/Arduino/libraries/Foo"}));
    library("home/Arduino/libraries/Bar", "Bar.h");
    library("book/libraries/MyBar", "Bar.h");
    EXPECT_EQ(having("Bar.h", "book/s").front(), "home/Arduino/libraries/Bar");
}

TEST_F(LibraryFolderTest, AHeaderMayStandInAFolderOfALibraryAndNotOutside) {
    library("libraries/Deep", "Deep.h");
    write("libraries/Deep/in/side.h", "");
    write("libraries/secret.h", "");
    EXPECT_EQ(having("in/side.h", "s"), Names{"libraries/Deep"});
    EXPECT_EQ(having("../secret.h", "s"), Names{});
    EXPECT_EQ(having((folder_ / "libraries/secret.h").string(), "s"), Names{});
}

TEST_F(LibraryFolderTest, TheUsersFolderIsTheFirstNamedOrTheSketchbooks) {
    EXPECT_EQ(user_libraries("/a:/b", "/home/me").value(), "/a");
    EXPECT_EQ(user_libraries("", "/home/me").value(), "/home/me/Arduino/libraries");
    EXPECT_FALSE(user_libraries("", ""));
}

}  // namespace
}  // namespace qduino::apps::library_folder_test
