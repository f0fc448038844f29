// Print: what reaches the device, byte for byte.
#include "arduino/Print.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

namespace print_test {
namespace {

/// Keeps what is written; can be full.
class TextPrint : public Print {
  public:
    std::size_t write(std::uint8_t value) override {
        if (text.size() >= room) return 0;
        text += static_cast<char>(value);
        return 1;
    }
    using Print::write;
    std::string text;
    std::size_t room = 1000;
};

class Point : public Printable {
  public:
    std::size_t printTo(Print& out) const override { return out.print("(1,2)"); }
};

template <typename... Arguments>
std::string printed(Arguments... arguments) {
    TextPrint out;
    const std::size_t size = out.print(arguments...);
    EXPECT_EQ(size, out.text.size());
    return out.text;
}

enum Colour { red = 3 };
struct Holder {
    static const int kInClass = 5;  // has no address: must not be bound to a reference
};

TEST(ArduinoPrint, WholeNumbersInEveryBase) {
    EXPECT_EQ(printed(78), "78");
    EXPECT_EQ(printed(-78), "-78");
    EXPECT_EQ(printed(78, BIN), "1001110");
    EXPECT_EQ(printed(78, OCT), "116");
    EXPECT_EQ(printed(78, DEC), "78");
    EXPECT_EQ(printed(78, HEX), "4E");
    EXPECT_EQ(printed(35, 36), "Z");
    EXPECT_EQ(printed(0, BIN), "0");
    EXPECT_EQ(printed(78, 0), "N");   // a raw byte
    EXPECT_EQ(printed(78, 1), "78");  // no such base
}

TEST(ArduinoPrint, NegativeNumbersInOtherBasesAreAsWideAsTheirType) {
    EXPECT_EQ(printed(-1, HEX), "FFFFFFFF");
    EXPECT_EQ(printed(-1LL, HEX), "FFFFFFFFFFFFFFFF");
    EXPECT_EQ(printed(static_cast<short>(-1), HEX), "FFFFFFFF");  // promoted to int
    EXPECT_EQ(printed(std::numeric_limits<long long>::min()), "-9223372036854775808");
}

TEST(ArduinoPrint, CharactersAndBytesDiffer) {
    EXPECT_EQ(printed('N'), "N");
    EXPECT_EQ(printed(static_cast<unsigned char>('N')), "78");
    EXPECT_EQ(printed('N', HEX), "4E");
    EXPECT_EQ(printed(true), "1");
    EXPECT_EQ(printed(red), "3");
}

/// What a Mega printed (avr-gcc 5.4, in simavr): its double has 24 bits, and half a unit of the
/// last digit may be too small to change it.
TEST(ArduinoPrint, AFloatHasTheDigitsOfAnAvr) {
    EXPECT_EQ(printed(333795.0625F, 3), "333795.062");
    EXPECT_EQ(printed(333795.0625, 3), "333795.062")
        << "a literal of a sketch's: a double with a float's value";
    EXPECT_EQ(printed(-333795.0625F, 3), "-333795.062");
    EXPECT_EQ(printed(8388607.5F, 1), "8388607.5");
    EXPECT_EQ(printed(2097152.75F, 1), "2097152.7");
    EXPECT_EQ(printed(0.1F, 8), "0.10000001");
    EXPECT_EQ(printed(1.0F / 3.0F, 10), "0.3333333492");
    EXPECT_EQ(printed(16777216.0F, 2), "16777216.00");
}

TEST(ArduinoPrint, ADoubleThatNoFloatHoldsKeepsItsPrecision) {
    EXPECT_EQ(printed(333795.06250001, 3), "333795.063");
    EXPECT_EQ(printed(0.1, 16), "0.1000000000000000");
    EXPECT_EQ(printed(16777217.5, 2), "16777217.50");
    EXPECT_EQ(printed(1.0 / 3.0, 12), "0.333333333333");
}

TEST(ArduinoPrint, FloatsRoundHalfAwayFromZero) {
    EXPECT_EQ(printed(1.23456), "1.23");
    EXPECT_EQ(printed(1.23456, 0), "1");
    EXPECT_EQ(printed(1.23456, 4), "1.2346");
    EXPECT_EQ(printed(0.5, 0), "1");
    EXPECT_EQ(printed(2.5, 0), "3");
    EXPECT_EQ(printed(-2.5, 0), "-3");
    EXPECT_EQ(printed(9.999), "10.00");
    EXPECT_EQ(printed(-0.001), "-0.00");
    EXPECT_EQ(printed(3.14F, 3), "3.140");
    EXPECT_EQ(printed(1.5, -1), "1.50");
    EXPECT_EQ(printed(1.0, 99).size(), 32U);  // as many decimals as there is room for, no more
}

TEST(ArduinoPrint, FloatsThatAreNoNumbers) {
    EXPECT_EQ(printed(std::nan("")), "nan");
    EXPECT_EQ(printed(INFINITY), "inf");
    EXPECT_EQ(printed(5e9), "ovf");
    EXPECT_EQ(printed(-5e9), "ovf");
    EXPECT_EQ(printed(4294967040.0, 0), "4294967040");
}

TEST(ArduinoPrint, LinesAndThings) {
    TextPrint out;
    EXPECT_EQ(out.println("hello"), 7U);
    out.println(7, BIN);
    out.println(1.5, 1);
    out.println(String("s"));
    out.println(F("flash"));
    out.println(Point());
    out.println(Holder::kInClass);
    out.println();
    EXPECT_EQ(out.text, "hello\r\n111\r\n1.5\r\ns\r\nflash\r\n(1,2)\r\n5\r\n\r\n");
}

TEST(ArduinoPrint, AFullDeviceIsSaidInTheCount) {
    TextPrint out;
    out.room = 3;
    EXPECT_EQ(out.print("hello"), 3U);
    EXPECT_EQ(out.text, "hel");
    EXPECT_EQ(out.write(static_cast<const char*>(nullptr)), 0U);
}

}  // namespace
}  // namespace print_test
