"""`long` has 32 bits in sketches and libraries: three kinds of code that were written for them give what an AVR gives."""

import unittest

from sketch_case import SketchCase

# The kinds: a number put together from bytes and made signed (HX711); a difference of micros()
# with an earlier one in 32 bits (RTClib's RTC_Micros); a clock that catches up second by second
# with millis() (TimeLib). And an overload for each.
LIBRARY = """
#pragma once
#include <Arduino.h>
long signed_from_24_bits(uint8_t high, uint8_t middle, uint8_t low);

class SecondsOfMicros {
 public:
  void begin() { last_ = micros(); }
  uint32_t seconds() {
    const uint32_t whole = (micros() - last_) / 1000000;
    last_ += whole * 1000000;
    return seconds_ += whole;
  }
 private:
  uint32_t last_ = 0, seconds_ = 0;
};

class SecondsOfMillis {
 public:
  unsigned long seconds() {
    while (millis() - then_ >= 1000) { ++seconds_; then_ += 1000; }
    return seconds_;
  }
 private:
  uint32_t then_ = 0;
  unsigned long seconds_ = 0;
};

class Display {
 public:
  void show(int number);
  void show(long number);
  void show(unsigned int number);
  void show(unsigned long number);
};
"""
LIBRARY_SOURCE = """
#include "kinds.h"
long signed_from_24_bits(uint8_t high, uint8_t middle, uint8_t low) {
  const uint8_t filler = high & 0x80 ? 0xFF : 0;
  const unsigned long value = static_cast<unsigned long>(filler) << 24 | static_cast<unsigned long>(high) << 16 |
                              static_cast<unsigned long>(middle) << 8 | low;
  return static_cast<long>(value);
}
void Display::show(int number) { char text[16]; sprintf(text, "%d", number); Serial.println(text); }
void Display::show(long number) { char text[16]; sprintf(text, "%ld", number); Serial.println(text); }
void Display::show(unsigned int number) { char text[16]; sprintf(text, "%u", number); Serial.println(text); }
void Display::show(unsigned long number) { char text[16]; sprintf(text, "%lu", number); Serial.println(text); }
"""
SKETCH = """
#include "kinds.h"
static_assert(sizeof(1000UL) == BYTES && sizeof(long) == BYTES && sizeof(unsigned long int) == BYTES);
static_assert(sizeof(long long) == 8 && sizeof(4294967296L) == 8);
SecondsOfMicros of_micros;
SecondsOfMillis of_millis;
Display display;

void setup() {
  Serial.begin(9600);
  display.show(signed_from_24_bits(0xFF, 0xFF, 0xFF));
  display.show(signed_from_24_bits(0x80, 0, 0));
  display.show(signed_from_24_bits(0x7F, 0xFF, 0xFF));
  Serial.println(-1L, HEX);
  of_micros.begin();
  for (int minutes = 0; minutes < 80; minutes += 10) { delay(600000UL); of_micros.seconds(); }
  display.show(of_micros.seconds());
  unsigned long last = millis();
  int kept = 0;
  for (int days = 0; days < 51; ++days) {
    while (millis() - last < 86400000UL) delay(3600000UL);
    last += 86400000UL;
    if (of_millis.seconds() == 4800 + 86400UL * (days + 1)) ++kept;
  }
  display.show(kept);
}
void loop() { delay(100000000UL); }
"""


# Formats that travel, and what a sketch calls a number of 64 bits.
TRAVELLING = """
#include <inttypes.h>
#include <stdarg.h>
const char kFormat[] PROGMEM = "%ld|%lu";
void say(const char* format, ...) {
  char text[80];
  va_list values;
  va_start(values, format);
  vsnprintf(text, sizeof text, format, values);
  va_end(values);
  Serial.println(text);
}
int bytes_of(int) { return 4; }
int bytes_of(long long) { return 8; }
void setup() {
  Serial.begin(9600);
  char text[80];
  say("%ld %s", -1L, "x");
  sprintf_P(text, kFormat, -2L, 4294967295UL);
  Serial.println(text);
  sprintf(text, millis() == 0 ? "a%ld" : "b%ld", -3L);
  Serial.println(text);
  long got[2] = {5, 77};
  const char* format = "%ld";
  sscanf("-5", format, &got[0]);
  say("%ld %ld", got[0], got[1]);
  say("%" PRId64 " %" PRIu64 " %lld", (int64_t)-7, UINT64_MAX, -8LL);
  say("%d %d %d", bytes_of((int64_t)5), bytes_of(5000000000), bytes_of(INT64_C(1) << 33));
  say("%d %d %d", (int)sizeof(random(5)), (int)sizeof(map(1, 2, 3, 4, 5)), (int)sizeof(Serial.parseInt()));
  say("%ld %lu", strtol("3000000000", 0, 10), strtoul("-1", 0, 10));
}
void loop() { delay(1000); }
"""


# An own yield(), Serial and a pin in a constructor, a value function without its return, tables
# that narrow, bits of a port, an open input that is pulled up.
AS_ON_AN_AVR = """
volatile int yielded = 0;
void yield() { yielded = 1; }
struct Logger { Logger() { Serial.begin(9600); pinMode(13, OUTPUT); digitalWrite(13, HIGH); } } logger;
int greet() { Serial.println("hello"); }
const char kGlyphs[] = {0x81, 0x42};
const byte kMask[] = {-1};
void setup() {
  greet();
  Serial.println(digitalRead(13));
  delay(5);
  Serial.println(yielded);
  bitSet(PORTB, PB6);
  struct { unsigned low : 3; } field = {};
  bitSet(field.low, 2);
  Serial.println((int)field.low);
  Serial.println((int)kGlyphs[0]);
  Serial.println(kMask[0]);
  pinMode(4, INPUT); digitalWrite(4, HIGH);
  pinMode(5, INPUT_PULLUP);
  pinMode(6, INPUT);
  Serial.print(digitalRead(4)); Serial.print(digitalRead(5)); Serial.println(digitalRead(6));
}
void loop() { delay(1000); }
"""


class Long(SketchCase):
    def test_formats_travel(self):
        self.write("travelling/travelling.ino", TRAVELLING)
        done = self.run_qduino("sim", "travelling", "--for", "1")
        self.assertEqual(done.stdout.splitlines()[:8], ["-1 x", "-2|4294967295", "a-3", "-5 77", "-7 18446744073709551615 -8", "8 8 8",
                                                        "4 4 4", "2147483647 4294967295"], done.stderr)

    def test_what_works_on_an_avr(self):
        self.write("avr/avr.ino", AS_ON_AN_AVR)
        self.write("avr/src/.git/old.cpp", "no source of the sketch's")
        done = self.run_qduino("sim", "avr", "--for", "1")
        self.assertEqual(done.stdout.split()[:7], ["hello", "1", "1", "4", "-127", "255", "110"], done.stderr)

    def test_a_main_of_its_own_is_refused_by_name(self):
        self.write("own/own.ino", "void setup() {}\nvoid loop() {}\nint main() {\n  for (;;) loop();\n}\n")
        failed = self.run_qduino("build", "own", "--only", "sim", status=1)
        self.assertRegex(failed.stderr, r"own\.ino:3:5: error: a sketch has no main\(\)")

    def sketch(self, width):
        self.write("kinds/kinds.ino", SKETCH.replace("BYTES", str(width // 8)))
        self.write("kinds/kinds.h", LIBRARY)
        self.write("kinds/kinds.cpp", LIBRARY_SOURCE)

    def test_libraries_written_for_32_bits_give_what_an_avr_gives(self):
        self.sketch(32)
        done = self.run_qduino("sim", "kinds", "--for", "4500000")
        self.assertEqual(done.stdout.split(), ["-1", "-8388608", "8388607", "FFFFFFFF", "4800", "51"], done.stderr)

    def test_with_64_bits_they_are_wrong_without_a_word(self):
        self.sketch(64)
        done = self.run_qduino("sim", "kinds", "--for", "20000", QDUINO_LONG="64")
        self.assertEqual(done.stdout.split()[:4], ["4294967295", "4286578688", "8388607", "F" * 16])
        self.assertNotEqual(done.stdout.split()[4], "4800")

    def test_messages_point_into_the_sketch(self):
        self.write("wrong/wrong.ino", "void setup() {}\nvoid loop() {\n  unsigned long a = 5UL; undeclared(a);\n}\n")
        failed = self.run_qduino("build", "wrong", "--only", "sim", status=1)
        self.assertRegex(failed.stderr, r"wrong\.ino:3:26: error: .*undeclared")


if __name__ == "__main__":
    unittest.main()
