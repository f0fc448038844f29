// Arithmetic of the language. Expected values are worked out from the language reference.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "arduino/Arduino.h"

TEST(ArduinoNumbers, MinAndMaxTakeMixedTypes) {
    EXPECT_EQ(min(3, 7), 3);
    EXPECT_EQ(max(3, 7UL), 7UL);
    EXPECT_DOUBLE_EQ(min(2.5, 2), 2.0);
    const unsigned char small = 200;
    EXPECT_EQ(max(small, 100), 200);
}

TEST(ArduinoNumbers, ConstrainHoldsInsideBothBounds) {
    EXPECT_EQ(constrain(5, 10, 150), 10);
    EXPECT_EQ(constrain(75, 10, 150), 75);
    EXPECT_EQ(constrain(200, 10, 150), 150);
    EXPECT_DOUBLE_EQ(constrain(1.5, 0, 1), 1.0);
    // The type is that of arithmetic on all three: no bound is cut to the value's own.
    EXPECT_EQ(constrain(byte{20}, 300, 1023), 300);
    EXPECT_EQ(constrain('z', 200, 300), 200);
    EXPECT_DOUBLE_EQ(constrain(0, 0.5, 2.5), 0.5);
    EXPECT_DOUBLE_EQ(constrain(9, 0.0, 2.5), 2.5);
}

TEST(ArduinoNumbers, MapGoesThroughWholeNumbers) {
    EXPECT_EQ(map(512, 0, 1023, 0, 255), 127);
    EXPECT_EQ(map(0, 1, 50, 50, 1), 51);  // backwards, and not held inside the range
    EXPECT_EQ(map(50, 1, 50, 50, -100), -100);
    EXPECT_EQ(map(2, 5, 5, 8, 9), 8);  // an empty range does not divide by zero
}

TEST(ArduinoNumbers, AbsSqAndAngles) {
    EXPECT_EQ(abs(-5), 5);
    EXPECT_DOUBLE_EQ(abs(-2.5), 2.5);
    EXPECT_EQ(abs(7UL), 7UL);
    EXPECT_EQ(sq(-4), 16);
    EXPECT_NEAR(radians(180), PI, 1e-12);
    EXPECT_NEAR(degrees(HALF_PI), 90, 1e-12);
}

TEST(ArduinoNumbers, RoundIsAWholeNumberAndStdRoundIsNot) {
    static_assert(std::is_same_v<decltype(round(2.6)), long>);
    EXPECT_EQ(round(2.6), 3);
    EXPECT_EQ(round(-2.5), -3);
    EXPECT_EQ(round(7), 7);
    EXPECT_EQ(round(2.5F), 3);
    static_assert(std::is_same_v<decltype(std::round(2.6)), double>);
    EXPECT_DOUBLE_EQ(std::round(2.6), 3.0);
    EXPECT_FLOAT_EQ(std::round(2.4F), 2.0F);
}

/// The types are those that the AVR core's macros give. The type decides how the value is printed,
/// and which overload is called.
TEST(ArduinoNumbers, HaveTheTypesOfTheMacros) {
    const unsigned char byte_value = 200;
    const signed char small = -3;
    const unsigned short half = 40000;
    const std::uint32_t wide = 0x80000000U;
    const float real = -2.5F;
    static_assert(std::is_same_v<decltype(bitRead(wide, 31)), std::uint32_t>);
    static_assert(std::is_same_v<decltype(bitRead(byte_value, 7)), int>);
    static_assert(std::is_same_v<decltype(bitRead(std::int64_t{1}, 7)), std::int64_t>);
    static_assert(std::is_same_v<decltype(abs(byte_value)), int>);
    static_assert(std::is_same_v<decltype(abs(half)), int>);
    static_assert(std::is_same_v<decltype(abs(small)), int>);
    static_assert(std::is_same_v<decltype(abs(wide)), std::uint32_t>);
    static_assert(std::is_same_v<decltype(abs(real)), float>);
    static_assert(std::is_same_v<decltype(abs(true)), int>);
    static_assert(std::is_same_v<decltype(sq(byte_value)), int>);
    static_assert(std::is_same_v<decltype(sq(wide)), std::uint32_t>);
    static_assert(std::is_same_v<decltype(min(byte_value, byte_value)), unsigned char>);
    static_assert(std::is_same_v<decltype(max(small, byte_value)), int>);
    static_assert(std::is_same_v<decltype(constrain(byte_value, 0, real)), float>);
    static_assert(std::is_same_v<decltype(lowByte(wide)), std::uint8_t>);
    static_assert(std::is_same_v<decltype(highByte(half)), std::uint8_t>);
    static_assert(std::is_same_v<decltype(bit(3)), qduino::arduino::UnsignedLong>);
    static_assert(std::is_same_v<decltype(+B101), int>);
    EXPECT_EQ(bitRead(wide, 31), 1U);
    EXPECT_EQ(abs(byte_value), 200);
    EXPECT_EQ(abs(small), 3);
}

TEST(ArduinoNumbers, BitsOfEveryWidth) {
    unsigned char value = 0b1000;
    EXPECT_EQ(bitRead(value, 3), 1);
    EXPECT_EQ(bitRead(value, 2), 0);
    bitSet(value, 0);
    EXPECT_EQ(value, 0b1001);
    bitClear(value, 3);
    EXPECT_EQ(value, 0b0001);
    bitWrite(value, 7, 1);
    EXPECT_EQ(value, 0b10000001);
    bitWrite(value, 7, 0);
    bitToggle(value, 0);
    EXPECT_EQ(value, 0);
    std::uint64_t wide = 0;
    bitSet(wide, 40);
    EXPECT_EQ(wide, std::uint64_t{1} << 40);
    EXPECT_EQ(bit(5), 32UL);
    EXPECT_EQ(lowByte(0x1234), 0x34);
    EXPECT_EQ(highByte(0x1234), 0x12);
    EXPECT_EQ(word(0x12, 0x34), 0x1234);
    const word as_type = word(0xabcd);
    EXPECT_EQ(as_type, 0xabcd);
}

TEST(ArduinoNumbers, BinaryConstants) {
    EXPECT_EQ(B101, 5);
    EXPECT_EQ(B00000101, 5);
    EXPECT_EQ(B11111111, 255);
}

TEST(ArduinoNumbers, RandomIsTheSameForTheSameSeedAndInsideItsRange) {
    randomSeed(42);
    std::vector<long> first;
    for (int i = 0; i < 100; ++i) first.push_back(random(1000));
    randomSeed(42);
    for (const long expected : first) EXPECT_EQ(random(1000), expected);
    randomSeed(0);  // ignored, as on the AVR: the sequence goes on
    EXPECT_GT(std::set<long>(first.begin(), first.end()).size(), 80U);
    std::set<long> seen;
    for (int i = 0; i < 1000; ++i) seen.insert(random(-3, 4));
    EXPECT_EQ(seen, (std::set<long>{-3, -2, -1, 0, 1, 2, 3}));
    EXPECT_EQ(random(0), 0);
    EXPECT_EQ(random(-5), 0);
    EXPECT_EQ(random(9, 9), 9);
}

TEST(ArduinoNumbers, CharacterFunctionsAreAsciiOnly) {
    EXPECT_TRUE(isAlpha('q'));
    EXPECT_FALSE(isAlpha(0xe4));  // ä in Latin-1
    EXPECT_TRUE(isDigit('7'));
    EXPECT_TRUE(isHexadecimalDigit('f'));
    EXPECT_FALSE(isHexadecimalDigit('g'));
    EXPECT_TRUE(isWhitespace('\t'));
    EXPECT_FALSE(isWhitespace('\n'));
    EXPECT_TRUE(isSpace('\n'));
    EXPECT_TRUE(isPunct('!'));
    EXPECT_TRUE(isControl('\n'));
    EXPECT_FALSE(isPrintable('\n'));
    EXPECT_TRUE(isGraph('x'));
    EXPECT_FALSE(isGraph(' '));
    EXPECT_FALSE(isAscii(200));
    EXPECT_EQ(toUpperCase('x'), 'X');
    EXPECT_EQ(toLowerCase('X'), 'x');
}

TEST(ArduinoNumbers, ProgramMemoryReadsTheAvrsWidths) {
    static const std::uint16_t table[] PROGMEM = {0x1122, 0x3344};
    EXPECT_EQ(pgm_read_word(&table[1]), 0x3344);
    static const char text[] PROGMEM = "in flash";
    EXPECT_EQ(pgm_read_byte(&text[3]), 'f');
    EXPECT_EQ(strlen_P(text), 8U);
    static const char other[] PROGMEM = "other";
    static const char* const texts[] PROGMEM = {text, other};
    char buffer[16];
    strcpy_P(buffer, (char*)pgm_read_word(&(texts[1])));  // the language reference's own example
    EXPECT_STREQ(buffer, "other");
    static void (*const functions[])() PROGMEM = {nullptr, nullptr};
    EXPECT_EQ(pgm_read_word(&functions[0]), 0U);
    EXPECT_EQ(String(F("in flash")), text);
}
