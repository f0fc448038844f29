// Keyboard and Mouse: the reports that go to the gadget, for which a pipe stands.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "arduino/libraries/hid/Keyboard.h"
#include "arduino/libraries/hid/Mouse.h"
#include "posix/unique_fd.h"
#include "tests/unit/arduino/arduino_fixture.h"

namespace hid_test {
namespace {

using Report = std::vector<int>;

class ArduinoHid : public ArduinoTest {
  protected:
    void SetUp() override {
        ArduinoTest::SetUp();
        path_ = testing::TempDir() + "qduino-hid-" + std::to_string(getpid());
        ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
        host_.reset(::open(path_.c_str(), O_RDONLY | O_NONBLOCK));
        setenv("QDUINO_KEYBOARD", path_.c_str(), 1);
        setenv("QDUINO_MOUSE", path_.c_str(), 1);
    }
    void TearDown() override {
        unsetenv("QDUINO_KEYBOARD");
        unsetenv("QDUINO_MOUSE");
        unlink(path_.c_str());
        ArduinoTest::TearDown();
    }
    /// The next report of so many bytes; empty: none came.
    Report next(std::size_t size) {
        std::array<std::uint8_t, 8> bytes{};
        const ssize_t count = ::read(host_.get(), bytes.data(), size);
        return count > 0 ? Report(bytes.begin(), bytes.begin() + count) : Report{};
    }
    Report key() { return next(8); }

    std::string path_;
    qduino::posix::UniqueFd host_;
};

// The codes are those of the HID Usage Tables, section 10.
TEST_F(ArduinoHid, TextBecomesPressesAndReleases) {
    Keyboard.begin();
    EXPECT_EQ(Keyboard.print("aZ?0\n"), 5U);
    const std::pair<int, int> expected[] = {{0, 0x04}, {2, 0x1D}, {2, 0x38}, {0, 0x27}, {0, 0x28}};
    for (const auto& [modifiers, code] : expected) {
        EXPECT_EQ(key(), (Report{modifiers, 0, code, 0, 0, 0, 0, 0}));
        EXPECT_EQ(key(), (Report{0, 0, 0, 0, 0, 0, 0, 0}));
    }
    EXPECT_EQ(Keyboard.write(std::uint8_t{0x01}), 0U) << "no such key";
    EXPECT_EQ(key(), Report{});
    Keyboard.end();
    key();
}

TEST_F(ArduinoHid, KeysAreHeldTogetherSixAtMost) {
    Keyboard.begin();
    EXPECT_EQ(Keyboard.press(KEY_LEFT_CTRL), 1U);
    EXPECT_EQ(key(), (Report{1, 0, 0, 0, 0, 0, 0, 0}));
    EXPECT_EQ(Keyboard.press(KEY_UP_ARROW), 1U);
    EXPECT_EQ(key(), (Report{1, 0, 0x52, 0, 0, 0, 0, 0}));
    for (const char letter : {'b', 'c', 'd', 'e', 'f'})
        EXPECT_EQ(Keyboard.press(static_cast<std::uint8_t>(letter)), 1U);
    for (int i = 0; i < 5; ++i) key();
    EXPECT_EQ(Keyboard.press('g'), 0U) << "the seventh";
    EXPECT_EQ(Keyboard.release('c'), 1U);
    EXPECT_EQ(key(), (Report{1, 0, 0x52, 5, 0, 7, 8, 9}));
    Keyboard.press(KEY_F12);
    EXPECT_EQ(key(), (Report{1, 0, 0x52, 5, 0x45, 7, 8, 9}));
    Keyboard.releaseAll();
    EXPECT_EQ(key(), (Report{0, 0, 0, 0, 0, 0, 0, 0}));
    Keyboard.end();
    key();
}

TEST_F(ArduinoHid, TheMouseMovesAndClicks) {
    Mouse.begin();
    Mouse.press(MOUSE_RIGHT);
    EXPECT_EQ(next(4), (Report{2, 0, 0, 0}));
    EXPECT_TRUE(Mouse.isPressed(MOUSE_RIGHT));
    Mouse.move(-3, 100, -1);
    EXPECT_EQ(next(4), (Report{2, 0xFD, 100, 0xFF}));
    Mouse.click();
    EXPECT_EQ(next(4), (Report{3, 0, 0, 0}));
    EXPECT_EQ(next(4), (Report{2, 0, 0, 0}));
    Mouse.end();
    EXPECT_EQ(next(4), (Report{0, 0, 0, 0}));
    EXPECT_FALSE(Mouse.isPressed(MOUSE_RIGHT));
}

TEST_F(ArduinoHid, AComputerThatIsNoKeyboardSaysSo) {
    setenv("QDUINO_KEYBOARD", "/dev/no/gadget", 1);
    Keyboard.begin();
    EXPECT_EQ(errors(), std::vector<std::string>{"Keyboard.begin(0)"});
    EXPECT_EQ(Keyboard.write('a'), 0U);
    Keyboard.releaseAll();
}

}  // namespace
}  // namespace hid_test
