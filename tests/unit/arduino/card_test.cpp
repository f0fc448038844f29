// SD: a folder as a memory card.
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "arduino/libraries/SD/SD.h"
#include "tests/unit/arduino/arduino_fixture.h"

namespace card_test {
namespace {

namespace fs = std::filesystem;

class ArduinoCard : public ArduinoTest {
  protected:
    void SetUp() override {
        ArduinoTest::SetUp();
        folder_ = fs::path(testing::TempDir()) / ("qduino-card-" + std::to_string(getpid()));
        fs::remove_all(folder_);
        setenv("QDUINO_SD", (folder_ / "card").c_str(), 1);
        ASSERT_TRUE(SD.begin(4));
    }
    void TearDown() override {
        SD.end();
        unsetenv("QDUINO_SD");
        fs::remove_all(folder_);
        ArduinoTest::TearDown();
    }
    fs::path folder_;
};

TEST_F(ArduinoCard, WhatIsWrittenIsAppendedAndReadBack) {
    File log = SD.open("log.txt", FILE_WRITE);
    ASSERT_TRUE(static_cast<bool>(log));
    EXPECT_EQ(log.println("first"), 7U);
    log.close();
    EXPECT_FALSE(static_cast<bool>(log));
    log = SD.open("/log.txt", FILE_WRITE);
    EXPECT_EQ(log.position(), 7U) << "at its end";
    log.print(23);
    log.flush();
    EXPECT_EQ(fs::file_size(folder_ / "card/log.txt"), 9U);
    EXPECT_TRUE(log.seek(0));
    EXPECT_EQ(log.readStringUntil('\r'), "first") << "a file that is written can be read";
    log = SD.open("log.txt");
    EXPECT_STREQ(log.name(), "log.txt");
    EXPECT_EQ(log.size(), 9U);
    EXPECT_TRUE(log.seek(7));
    EXPECT_EQ(log.available(), 2);
    EXPECT_EQ(log.peek(), '2');
    EXPECT_EQ(log.read(), '2');
    File same = log;
    EXPECT_EQ(same.read(), '3') << "copies share the place";
    EXPECT_EQ(log.read(), -1);
    EXPECT_EQ(log.peek(), -1);
    EXPECT_EQ(log.available(), 0);
    EXPECT_FALSE(log.seek(10));
    EXPECT_EQ(log.position(), 9U);
    EXPECT_EQ(log.write("x"), 0U) << "it was opened to be read";
    EXPECT_NE(log.getWriteError(), 0);
}

TEST_F(ArduinoCard, ANewFileMayReplaceAnOldOne) {
    SD.open("a", FILE_WRITE).print("a long text");
    SD.open("a", O_READ | O_WRITE | O_CREAT | O_TRUNC).print("new");
    char text[8] = {};
    EXPECT_EQ(SD.open("a").read(text, sizeof text), 3);
    EXPECT_STREQ(text, "new");
    EXPECT_FALSE(static_cast<bool>(SD.open("missing")));
    EXPECT_FALSE(static_cast<bool>(SD.open("no/such/folder/file", FILE_WRITE)));
    File nothing;
    EXPECT_EQ(nothing.read(), -1);
    EXPECT_EQ(nothing.print("x"), 0U);
    EXPECT_EQ(nothing.size(), 0U);
    EXPECT_STREQ(nothing.name(), "");
}

TEST_F(ArduinoCard, FoldersAreWalkedInTheOrderOfTheNames) {
    EXPECT_TRUE(SD.mkdir("logs/old"));
    for (const char* name : {"logs/c.txt", "logs/a.txt", "logs/b.txt"}) SD.open(name, FILE_WRITE).print(name);
    File folder = SD.open("/logs/");
    ASSERT_TRUE(folder.isDirectory());
    EXPECT_EQ(folder.read(), -1);
    for (int round = 0; round < 2; ++round) {
        std::string names;
        while (File entry = folder.openNextFile())
            names += std::string(entry.name()) + (entry.isDirectory() ? "/ " : " ");
        EXPECT_EQ(names, "a.txt b.txt c.txt old/ ");
        folder.rewindDirectory();
    }
    EXPECT_TRUE(SD.exists("logs/a.txt"));
    EXPECT_TRUE(SD.remove("logs/a.txt"));
    EXPECT_FALSE(SD.exists("logs/a.txt"));
    EXPECT_FALSE(SD.remove("logs/a.txt"));
    EXPECT_FALSE(SD.rmdir("logs")) << "it is not empty";
    EXPECT_TRUE(SD.rmdir("logs/old"));
    EXPECT_FALSE(SD.rmdir("/")) << "the card itself stays";
}

TEST_F(ArduinoCard, NothingLiesAboveTheCard) {
    std::ofstream(folder_ / "outside") << "secret";
    EXPECT_FALSE(SD.exists("../outside"));
    EXPECT_FALSE(static_cast<bool>(SD.open("logs/../../outside")));
    EXPECT_FALSE(SD.remove("../outside"));
    EXPECT_FALSE(SD.mkdir("../beside"));
    EXPECT_TRUE(SD.exists("/")) << "the card's own folder";
}

TEST_F(ArduinoCard, ACardThatCannotBeMadeIsReported) {
    setenv("QDUINO_SD", "/proc/no/card", 1);
    SD.end();
    EXPECT_FALSE(SD.exists("/")) << "not begun";
    EXPECT_FALSE(SD.begin());
    EXPECT_EQ(errors(), std::vector<std::string>{"SD.begin(0)"});
    EXPECT_FALSE(static_cast<bool>(SD.open("x", FILE_WRITE)));
}

}  // namespace
}  // namespace card_test
