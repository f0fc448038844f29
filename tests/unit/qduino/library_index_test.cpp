#include "qduino/library/library_index.h"

#include <gtest/gtest.h>

#include "qduino/library/library_discovery.h"

namespace qduino::apps::library_index_test {
namespace {

constexpr const char* kIndex = R"({"libraries": [
  {"name": "Bounce", "version": "1.9.0", "url": "https://x/b190.zip", "size": 7,
   "checksum": "SHA-256:ABCDEF", "sentence": "Debounces keys", "dependencies": [{"name": "Ring"}, {"name": ""}, 3]},
  {"name": "Bounce", "version": "1.10.0", "url": "https://x/b1100.zip", "checksum": "MD5:1234", "size": -3},
  {"name": "Ring", "version": "0.1", "url": "https://x/r.zip", "sentence": "A ring of KEYS"},
  {"name": "NoUrl", "version": "1"}, {"version": "1", "url": "u"}, "nonsense", {"name": 3, "version": "1", "url": "u"}
]})";

TEST(LibraryIndexTest, TheNewestIsFoundUnlessAVersionIsAskedFor) {
    const Result<LibraryIndex> index = LibraryIndex::read(kIndex);
    ASSERT_TRUE(index);
    ASSERT_NE(index->find("Bounce"), nullptr);
    EXPECT_EQ(index->find("Bounce")->version, "1.10.0");
    EXPECT_EQ(index->find("Bounce")->sha256, "");  // of another kind
    EXPECT_EQ(index->find("Bounce")->size, 0u);
    const IndexedLibrary* older = index->find("Bounce", "1.9");
    ASSERT_NE(older, nullptr);
    EXPECT_EQ(older->sha256, "abcdef");
    EXPECT_EQ(older->size, 7u);
    EXPECT_EQ(older->depends, std::vector<std::string>{"Ring"});
    EXPECT_EQ(index->find("Bounce", "2"), nullptr);
    EXPECT_EQ(index->find("NoUrl"), nullptr);
    EXPECT_EQ(index->find("bounce"), nullptr);
    EXPECT_EQ(index->nearest_name("bounce"), "Bounce");
    EXPECT_EQ(index->nearest_name("Bonuce"), "Bounce");
}

TEST(LibraryIndexTest, WordsAreLookedForInNameAndSentence) {
    const Result<LibraryIndex> index = LibraryIndex::read(kIndex);
    ASSERT_TRUE(index);
    const auto names = [&](const std::vector<std::string>& words) {
        std::vector<std::string> found;
        for (const IndexedLibrary* library : index->search(words))
            found.push_back(library->name + library->version);
        return found;
    };
    EXPECT_EQ(names({"keys"}), (std::vector<std::string>{"Bounce1.9.0", "Ring0.1"}));
    EXPECT_EQ(names({"ring", "keys"}), std::vector<std::string>{"Ring0.1"});
    EXPECT_EQ(names({"BOUNCE"}), std::vector<std::string>{"Bounce1.10.0"});
    EXPECT_TRUE(names({"nothing"}).empty());
}

TEST(LibraryIndexTest, WhatIsNoIndexIsRefused) {
    for (const char* text : {"", "{", "[]", "{}", "{\"libraries\": 3}", "\xff"})
        EXPECT_FALSE(LibraryIndex::read(text)) << text;
    EXPECT_TRUE(LibraryIndex::read("{\"libraries\": []}"));
}

TEST(LibraryIndexTest, VersionsAreComparedAsNumbers) {
    const std::vector<std::string> rising{"0.1",        "0.9.9",       "1.0.0-alpha", "1.0.0-alpha.2",
                                          "1.0.0-rc.1", "1.0.0-rc.10", "1",           "1.0.1",
                                          "1.2",        "1.10",        "2.0.0",       "10.0"};
    for (std::size_t i = 0; i < rising.size(); ++i) {
        for (std::size_t j = 0; j < rising.size(); ++j)
            EXPECT_EQ(compare_versions(rising[i], rising[j]), i <=> j) << rising[i] << ' ' << rising[j];
    }
    EXPECT_EQ(compare_versions("1.0.0", "1"), std::strong_ordering::equal);
}

TEST(MissingHeader, IsReadFromTheCompilersWords) {
    EXPECT_EQ(missing_header(
                  "In file included from /a/b.cpp:1:\n/a/c.h:3:10: fatal error: Foo/bar.h: No such file or "
                  "directory\n    3 | #include <Foo/bar.h>\ncompilation terminated.\n"),
              "Foo/bar.h");
    EXPECT_EQ(missing_header("/a/c.h:3:10: fatal error: 'Foo.h' file not found\n#include <Foo.h>\n"),
              "Foo.h");
    EXPECT_EQ(missing_header("/a/c.h:3:2: error: #error \"No such file or directory\"\n"), "");
    EXPECT_EQ(missing_header("fatal error: something else\n"), "");
    EXPECT_EQ(missing_header(""), "");
}

}  // namespace
}  // namespace qduino::apps::library_index_test
