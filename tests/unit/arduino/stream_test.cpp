// Stream's parsing, against bytes that arrive at known instants of virtual time.
#include "arduino/Stream.h"

#include <deque>
#include <limits>

#include "arduino/core/timing.h"
#include "tests/unit/arduino/arduino_fixture.h"

namespace stream_test {
namespace {

/// Each byte has come from its instant on.
class TimedStream : public Stream {
  public:
    void arrive(const std::string& text, int at_ms = 0, int apart_ms = 0) {
        for (const char c : text) {
            bytes_.push_back({qduino::kEpoch + std::chrono::milliseconds{at_ms}, c});
            at_ms += apart_ms;
        }
    }
    int available() override { return peek() < 0 ? 0 : 1; }
    int peek() override {
        const bool there = !bytes_.empty() && bytes_.front().at <= qduino::fake::state().now;
        return there ? static_cast<unsigned char>(bytes_.front().value) : -1;
    }
    int read() override {
        const int value = peek();
        if (value >= 0) bytes_.pop_front();
        return value;
    }
    std::size_t write(std::uint8_t) override { return 1; }
    using Print::write;

  private:
    struct Byte {
        qduino::Instant at;
        char value;
    };
    std::deque<Byte> bytes_;
};

class ArduinoStream : public ArduinoTest {
  protected:
    TimedStream stream;
};

TEST_F(ArduinoStream, ParseIntSkipsWhatIsNoNumberAndLeavesWhatFollows) {
    stream.arrive("abc-123,45\n");
    EXPECT_EQ(stream.parseInt(), -123);
    EXPECT_EQ(stream.read(), ',');
    EXPECT_EQ(stream.parseInt(), 45);
    EXPECT_EQ(stream.read(), '\n');
}

TEST_F(ArduinoStream, ParseIntKeepsAllDigitsOfALong) {
    stream.arrive("9007199254740993 ");  // 2^53 + 1: no double has it
    EXPECT_EQ(stream.parseInt(), 9007199254740993L);
}

TEST_F(ArduinoStream, ParseIntGivesZeroAfterTheTimeoutAndNotBefore) {
    stream.arrive("never", 0);
    stream.setTimeout(250);
    EXPECT_EQ(stream.parseInt(), 0);
    EXPECT_EQ(millis(), 250UL);
    EXPECT_EQ(board().spun_ns, 0) << "waiting for a byte costs no budget";
}

TEST_F(ArduinoStream, ANumberThatComesSlowlyIsWhole) {
    stream.arrive("1234;", 100, 900);  // each digit within the second that the timeout gives it
    EXPECT_EQ(stream.parseInt(), 1234);
}

TEST_F(ArduinoStream, LookaheadModes) {
    stream.arrive("x5 ");
    EXPECT_EQ(stream.parseInt(SKIP_NONE), 0);
    EXPECT_EQ(stream.peek(), 'x');
    EXPECT_EQ(stream.parseInt(SKIP_WHITESPACE), 0);
    EXPECT_EQ(stream.peek(), 'x');
    EXPECT_EQ(stream.parseInt(SKIP_ALL), 5);
    stream.arrive(" \t\r\n6 ");
    EXPECT_EQ(stream.parseInt(SKIP_WHITESPACE), 6);
}

TEST_F(ArduinoStream, AnIgnoredCharacterMayStandInANumber) {
    stream.arrive("32,767 ");
    EXPECT_EQ(stream.parseInt(SKIP_ALL, ','), 32767);
}

TEST_F(ArduinoStream, ParseFloat) {
    stream.arrive("T:-21.75C .5 7 1.2.3 ");
    EXPECT_FLOAT_EQ(stream.parseFloat(), -21.75F);
    EXPECT_FLOAT_EQ(stream.parseFloat(), 0.5F);
    EXPECT_FLOAT_EQ(stream.parseFloat(), 7.0F);
    EXPECT_FLOAT_EQ(stream.parseFloat(), 1.2F);  // a second point ends it
    EXPECT_FLOAT_EQ(stream.parseFloat(), 0.3F);
}

TEST_F(ArduinoStream, ParseFloatTakesAsManyDigitsAsCome) {
    const std::string many(400, '3'), zeros(400, '0');
    stream.arrive("0." + many + " -" + many + " 1" + zeros + "." + zeros + " 0." + zeros +
                  "7 00012.5 16777217 ");
    EXPECT_FLOAT_EQ(stream.parseFloat(), 1.0F / 3);
    EXPECT_EQ(stream.parseFloat(), -std::numeric_limits<float>::infinity());
    EXPECT_EQ(stream.parseFloat(), std::numeric_limits<float>::infinity());
    EXPECT_EQ(stream.parseFloat(), 0.0F);
    EXPECT_EQ(stream.parseFloat(), 12.5F);
    EXPECT_EQ(stream.parseFloat(), 16777216.0F);
}

TEST_F(ArduinoStream, FindFallsBackToTheLongestBeginning) {
    stream.arrive("aaab ababac!");
    EXPECT_TRUE(stream.find("aab"));
    EXPECT_TRUE(stream.find("abac"));
    EXPECT_EQ(stream.read(), '!');
    stream.setTimeout(10);
    EXPECT_FALSE(stream.find("x"));
    EXPECT_TRUE(stream.find(""));
}

TEST_F(ArduinoStream, FindUntilStopsAtTheTerminator) {
    stream.arrive("one;two");
    EXPECT_FALSE(stream.findUntil("two", ";"));
    EXPECT_TRUE(stream.findUntil("two", ";"));
}

TEST_F(ArduinoStream, ReadBytesAndStrings) {
    stream.arrive("hello world\nrest");
    char buffer[6] = {};
    EXPECT_EQ(stream.readBytes(buffer, 5), 5U);
    EXPECT_STREQ(buffer, "hello");
    EXPECT_EQ(stream.readStringUntil('\n'), " world");
    stream.setTimeout(20);
    EXPECT_EQ(stream.readString(), "rest");
    EXPECT_EQ(stream.readBytes(buffer, 5), 0U);
    stream.arrive("k=v;w", 0);
    EXPECT_EQ(stream.readBytesUntil('=', buffer, 5), 1U);
    EXPECT_EQ(stream.readBytesUntil(';', buffer, 5), 1U);
    EXPECT_EQ(buffer[0], 'v');
    EXPECT_EQ(stream.read(), 'w') << "the terminator is taken and dropped";
}

TEST_F(ArduinoStream, ByteAbove127IsNotTheEnd) {
    stream.arrive("\xff\x80z");
    char buffer[3];
    EXPECT_EQ(stream.readBytesUntil('z', buffer, 3), 2U);
    EXPECT_EQ(static_cast<unsigned char>(buffer[0]), 0xff);
}

TEST_F(ArduinoStream, AStoppedSketchDoesNotWait) {
    board().stop = true;
    EXPECT_EQ(stream.readString(), "");
    EXPECT_EQ(millis(), 0UL);
}

}  // namespace
}  // namespace stream_test
