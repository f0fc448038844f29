// String, by the language reference and, where that is silent, ArduinoCore-API's behaviour.
#include "arduino/WString.h"

#include <gtest/gtest.h>
#include <limits>
#include <utility>

#include "arduino/core/constants.h"

TEST(ArduinoString, NumbersByConstructor) {
    EXPECT_EQ(String(13), "13");
    EXPECT_EQ(String(-13), "-13");
    EXPECT_EQ(String(45, HEX), "2d");
    EXPECT_EQ(String(255, BIN), "11111111");
    EXPECT_EQ(String(-1, HEX), "ffffffff");  // as wide as its type
    EXPECT_EQ(String(static_cast<unsigned char>(7)), "7");
    EXPECT_EQ(String('a'), "a");
    EXPECT_EQ(String(5.698, 3), "5.698");
    EXPECT_EQ(String(2.5F), "2.50");
    EXPECT_EQ(String(1ULL << 63), "9223372036854775808");
    EXPECT_EQ(String("abcdef", 3U), "abc");
}

TEST(ArduinoString, AddingOfEverything) {
    String text = "pin " + String(13) + ' ' + 1.5 + "V, " + 7UL + F(" left");
    EXPECT_EQ(text, "pin 13 1.50V, 7 left");
    text = "";
    text += "a";
    text += 'b';
    text += 3;
    text += String("d");
    text += 0.5F;
    EXPECT_EQ(text, "ab3d0.50");
    EXPECT_FALSE(text.concat(static_cast<const char*>(nullptr)));
    EXPECT_EQ(text, "ab3d0.50");
    const String other = 3 + String("x");
    EXPECT_EQ(other, "3x");
    String twice = "ab";
    twice += twice;
    EXPECT_EQ(twice, "abab");
}

TEST(ArduinoString, Comparing) {
    EXPECT_TRUE(String("abc") == "abc");
    EXPECT_TRUE("abc" == String("abc"));
    EXPECT_TRUE(String("abc") != "abd");
    EXPECT_TRUE(String("999") > String("1000"));  // by characters
    EXPECT_LT(String("a").compareTo("b"), 0);
    EXPECT_TRUE(String("Hello").equalsIgnoreCase("hELLO"));
    EXPECT_FALSE(String("Hello").equalsIgnoreCase("hELL"));
    EXPECT_TRUE(String("HTTP/1.1 200 OK").startsWith("HTTP/1.1"));
    EXPECT_TRUE(String("HTTP/1.1 200 OK").startsWith("200 OK", 9));
    EXPECT_FALSE(String("ab").startsWith("abc"));
    EXPECT_FALSE(String("ab").startsWith("b", 7));
    EXPECT_TRUE(String("sensor = 12").endsWith("12"));
    EXPECT_FALSE(String("2").endsWith("12"));
}

TEST(ArduinoString, CharactersAndBounds) {
    String text = "SensorReading: 456";
    EXPECT_EQ(text.charAt(0), 'S');
    EXPECT_EQ(text.charAt(99), '\0');
    text.setCharAt(13, '=');
    EXPECT_EQ(text, "SensorReading= 456");
    text.setCharAt(99, 'x');
    text[99] = 'x';
    text[0] = 's';
    EXPECT_EQ(text, "sensorReading= 456");
    EXPECT_EQ(text[99], '\0');
    char buffer[7];
    text.toCharArray(buffer, sizeof buffer);
    EXPECT_STREQ(buffer, "sensor");
    text.toCharArray(buffer, sizeof buffer, 15);
    EXPECT_STREQ(buffer, "456");
    text.toCharArray(buffer, sizeof buffer, 99);
    EXPECT_STREQ(buffer, "");
    text.toCharArray(nullptr, 5);
}

TEST(ArduinoString, Searching) {
    const String text = "<HTML><HEAD><BODY>";
    EXPECT_EQ(text.indexOf('>'), 5);
    EXPECT_EQ(text.indexOf('>', 6), 11);
    EXPECT_EQ(text.indexOf("<BODY>"), 12);
    EXPECT_EQ(text.indexOf("<UL>"), -1);
    EXPECT_EQ(text.indexOf('<', 99), -1);
    EXPECT_EQ(text.lastIndexOf('<'), 12);
    EXPECT_EQ(text.lastIndexOf('<', 11), 6);
    EXPECT_EQ(text.lastIndexOf("<HEAD>"), 6);
    EXPECT_EQ(text.lastIndexOf("<UL>"), -1);
}

TEST(ArduinoString, SubstringReplaceRemove) {
    const String text = "Content-Type: text/html";
    EXPECT_EQ(text.substring(19), "html");
    EXPECT_EQ(text.substring(14, 18), "text");
    EXPECT_EQ(text.substring(18, 14), "text");  // in the wrong order
    EXPECT_EQ(text.substring(19, 99), "html");
    EXPECT_EQ(text.substring(99), "");
    String changed = text;
    changed.replace('t', 'T');
    EXPECT_EQ(changed, "ConTenT-Type: TexT/hTml");
    changed = "aaa";
    changed.replace("a", "aa");
    EXPECT_EQ(changed, "aaaaaa");
    changed.replace("", "x");
    EXPECT_EQ(changed, "aaaaaa");
    changed = "Hello World!";
    changed.remove(7, 2);
    EXPECT_EQ(changed, "Hello Wld!");
    changed.remove(5);
    EXPECT_EQ(changed, "Hello");
    changed.remove(99);
    EXPECT_EQ(changed, "Hello");
}

TEST(ArduinoString, CaseTrimAndNumbers) {
    String text = "  \tHello! \r\n";
    text.trim();
    EXPECT_EQ(text, "Hello!");
    text.toUpperCase();
    EXPECT_EQ(text, "HELLO!");
    text.toLowerCase();
    EXPECT_EQ(text, "hello!");
    String blank = "   ";
    blank.trim();
    EXPECT_TRUE(blank.isEmpty());
    EXPECT_EQ(String("1234 apples").toInt(), 1234);
    EXPECT_EQ(String("-17").toInt(), -17);
    EXPECT_EQ(String("apples").toInt(), 0);
    EXPECT_FLOAT_EQ(String("2.75kg").toFloat(), 2.75F);
    EXPECT_DOUBLE_EQ(String("x").toDouble(), 0);
}

TEST(ArduinoString, AFloatHasAllItsDigits) {
    EXPECT_EQ(String(std::numeric_limits<float>::max()), "340282346638528859811704183484516925440.00");
    EXPECT_EQ(String(-4294967296.0, 1), "-4294967296.0");
    EXPECT_EQ(String(std::numeric_limits<double>::max(), 255).length(), 309U + 1 + 30);
    EXPECT_EQ(String(std::numeric_limits<double>::infinity()), "inf");
}

TEST(ArduinoString, MovingIntoItselfKeepsIt) {
    String text("a text that is longer than fifteen characters");
    String& same = text;
    text = std::move(same);
    EXPECT_EQ(text, "a text that is longer than fifteen characters");
    String other;
    other = std::move(text);
    EXPECT_EQ(other.length(), 45U);
}

TEST(ArduinoString, ANullPointerIsNotAString) {
    const char* nothing = nullptr;
    String text(nothing);
    EXPECT_FALSE(static_cast<bool>(text));
    EXPECT_EQ(text.length(), 0U);
    text += "now it is";
    EXPECT_TRUE(static_cast<bool>(text));
    EXPECT_TRUE(static_cast<bool>(String()));
}
