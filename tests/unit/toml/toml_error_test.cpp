// A bounded Error of a TOML file: a list of what is accepted ends behind an entry, with its length.
#include <gtest/gtest.h>

#include <string>

#include "config/toml_section.h"

namespace qduino::apps::toml_error_test {
namespace {

std::string error_of(const std::string& text, std::string_view advice = {}) {
    return std::string{toml_error(text, advice).message.view()};
}

std::string listed(int entries) {
    std::string text = "m.toml:3: [hot_end] 'colour' is not known; accepted: ";
    for (int i = 0; i < entries; ++i) text += (i == 0 ? "key_" : ", key_") + std::to_string(i);
    return text;
}

TEST(TomlError, WhatFitsIsWhole) {
    EXPECT_EQ(error_of("m.toml:3: broken", " (mend it)"), "m.toml:3: broken (mend it)");
    EXPECT_EQ(error_of(listed(5), " (mend it)"), listed(5) + " (mend it)");
}

TEST(TomlError, ALongListEndsBehindAnEntryAndSaysHowManyThereAre) {
    for (int entries = 20; entries < 200; ++entries) {
        for (const std::string advice : {"", " (remove the file: the machine file counts)"}) {
            const std::string whole = listed(entries) + advice;
            const std::string text = error_of(listed(entries), advice);
            ASSERT_LE(text.size(), 236u);
            if (whole.size() <= 236) {
                EXPECT_EQ(text, whole);
                continue;
            }
            const std::string end = ", … (" + std::to_string(entries) + " in all)" + advice;
            ASSERT_TRUE(text.ends_with(end)) << text;
            const std::string kept = text.substr(0, text.size() - end.size());
            EXPECT_TRUE(listed(entries).starts_with(kept + ", key_")) << "behind a whole entry: " << kept;
            EXPECT_GT(text.size(), 236u - 10) << "as many as there is room for";
        }
    }
}

TEST(TomlError, ALongTextWithoutAListIsCut) {
    EXPECT_EQ(error_of(std::string(500, 'x')), std::string(236, 'x'));
}

}  // namespace
}  // namespace qduino::apps::toml_error_test
