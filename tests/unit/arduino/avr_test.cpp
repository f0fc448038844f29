// What libraries take from the AVR: port registers, SREG, the watchdog, its C library, and C's half
// of the language.
#include <iterator>
#include <set>
#include <string>
#include <utility>

#include "arduino/Arduino.h"
#include "arduino/WProgram.h"
#include "arduino/avr/boot.h"
#include "arduino/avr/common.h"
#include "arduino/avr/fuse.h"
#include "arduino/avr/interrupt.h"
#include "arduino/avr/io.h"
#include "arduino/avr/power.h"
#include "arduino/avr/sleep.h"
#include "arduino/avr/version.h"
#include "arduino/avr/wdt.h"
#include "arduino/compat/twi.h"
#include "arduino/util/atomic.h"
#include "arduino/util/crc16.h"
#include "arduino/util/delay.h"
#include "arduino/util/delay_basic.h"
#include "arduino/util/parity.h"
#include "arduino/util/setbaud.h"
#include "arduino/wiring_private.h"
#include "tests/unit/arduino/arduino_fixture.h"

extern "C" {
extern const double c_words[];
extern const unsigned c_word_count;
unsigned long c_half_works(int pin);
}

namespace avr_test {
namespace {

using qduino::fake::levels_written;

class ArduinoAvr : public ArduinoTest {
  protected:
    void SetUp() override {
        ArduinoTest::SetUp();
        board().wires = &nothing_;  // an output reads as it was written
        for (char port : {'A', 'B', 'C', 'D', 'E', 'F', 'G', 'H', 'J', 'K', 'L'})
            *portOutputRegister(port) = 0;
        interrupts();
        board().writes.clear();
        board().modes.clear();
    }
    void TearDown() override {
        for (int pin = 0; pin < NUM_DIGITAL_PINS; ++pin) pinMode(pin, INPUT);
        ArduinoTest::TearDown();
    }
    qduino::board::NoPeripherals nothing_;
};

// ---- ports --------------------------------------------------------------------------------------

TEST_F(ArduinoAvr, EveryPinIsOneBitOfOnePort) {
    std::set<std::pair<int, int>> seen;
    for (int pin = 0; pin < NUM_DIGITAL_PINS; ++pin) {
        const int mask = digitalPinToBitMask(pin);
        EXPECT_EQ(mask & (mask - 1), 0) << pin;
        EXPECT_GT(mask, 0) << pin;
        EXPECT_TRUE(seen.emplace(digitalPinToPort(pin), mask).second) << pin;
    }
    // Some that the Mega's pinout gives.
    EXPECT_EQ(digitalPinToPort(13), 'B');
    EXPECT_EQ(digitalPinToBitMask(13), _BV(7));
    EXPECT_EQ(digitalPinToPort(A15), 'K');
    EXPECT_EQ(digitalPinToBitMask(2), _BV(4));
    EXPECT_EQ(digitalPinToPort(2), 'E');
    EXPECT_EQ(digitalPinToPort(70), NOT_A_PORT);
    EXPECT_EQ(digitalPinToPort(-1), NOT_A_PORT);
    EXPECT_EQ(digitalPinToBitMask(-1), 0);
}

TEST_F(ArduinoAvr, APortRegisterMovesThePinsItNamesAndNoOthers) {
    DDRB = 0xc0;
    EXPECT_EQ(board().modes[13], qduino::board::PinMode::output);
    EXPECT_EQ(board().modes[12], qduino::board::PinMode::output);
    EXPECT_FALSE(board().modes.contains(11));
    board().writes.clear();
    PORTB |= _BV(7);
    EXPECT_EQ(levels_written(13), std::vector<int>{1});
    EXPECT_TRUE(levels_written(12).empty());
    EXPECT_EQ(PORTB, 0x80);
    PORTB ^= _BV(7) | _BV(6);
    EXPECT_EQ(PORTB, 0x40);
    PORTB &= ~_BV(6);
    EXPECT_EQ(PORTB, 0);
    PINB = _BV(6);  // toggles
    EXPECT_EQ(PORTB, 0x40);
    PORTB = 0x80;
    EXPECT_EQ(levels_written(13), (std::vector<int>{1, 0, 1}));
    EXPECT_EQ(DDRB, 0xc0);
}

TEST_F(ArduinoAvr, ABitOfAnInputIsItsPullUp) {
    board().wires = nullptr;
    board().level_of = [](int pin, qduino::Instant) { return pin == 22 ? 1 : 0; };
    PORTA |= _BV(1);
    EXPECT_EQ(board().modes[23], qduino::board::PinMode::input_pullup);
    EXPECT_EQ(PORTA, 0x02);
    EXPECT_EQ(PINA, 0x01);
    PORTA = 0;
    EXPECT_EQ(board().modes[23], qduino::board::PinMode::input);
    // As an output it begins at the register's level.
    PORTA = 0x02;
    board().writes.clear();
    DDRA |= _BV(1);
    EXPECT_EQ(levels_written(23).back(), 1);
    EXPECT_EQ(*portModeRegister(digitalPinToPort(23)), 0x02);
}

TEST_F(ArduinoAvr, RegistersAreFoundByPin) {
    pinMode(13, OUTPUT);
    *portOutputRegister(digitalPinToPort(13)) |= digitalPinToBitMask(13);
    EXPECT_EQ(levels_written(13).back(), 1);
    EXPECT_EQ(*portInputRegister(digitalPinToPort(13)) & digitalPinToBitMask(13), 0x80);
    *portOutputRegister(NOT_A_PORT) = 0xff;  // does nothing
    EXPECT_EQ(*portOutputRegister(NOT_A_PORT), 0);
    EXPECT_TRUE(errors().empty());
}

TEST_F(ArduinoAvr, ARegisterIsPrintedAsAByte) {
    class Text final : public Print {
      public:
        using Print::write;
        std::size_t write(std::uint8_t value) override { return text += static_cast<char>(value), 1; }
        std::string text;
    } out;
    DDRB = 0xc0;
    out.println(DDRB, HEX);
    out.println(DDRB);
    out.print(SREG);
    EXPECT_EQ(out.text, "C0\r\n192\r\n128");
}

// ---- interrupts, sleep, watchdog
// ------------------------------------------------------------------

TEST_F(ArduinoAvr, SregHoldsHandlersAndLetsThemGo) {
    EXPECT_EQ(SREG, 0x80);
    const std::uint8_t before = SREG;
    cli();
    EXPECT_EQ(SREG, 0);
    EXPECT_TRUE(runtime_.handlers_held());
    SREG = before;
    EXPECT_FALSE(runtime_.handlers_held());
}

TEST_F(ArduinoAvr, AnAtomicBlockRunsOnceAndLeavesItAsItWas) {
    int runs = 0;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        ++runs;
        EXPECT_TRUE(runtime_.handlers_held());
        ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { ++runs; }
        EXPECT_TRUE(runtime_.handlers_held()) << "the inner block ends, the outer goes on";
    }
    EXPECT_EQ(runs, 2);
    EXPECT_FALSE(runtime_.handlers_held());
    cli();
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {}
    EXPECT_TRUE(runtime_.handlers_held());
    ATOMIC_BLOCK(ATOMIC_FORCEON) {}
    EXPECT_FALSE(runtime_.handlers_held());
}

TEST_F(ArduinoAvr, SleepEndsAtTheNextMillisecond) {
    set_sleep_mode(SLEEP_MODE_PWR_DOWN);
    sleep_mode();
    EXPECT_EQ(board().slept_ns, 1'000'000);
}

TEST_F(ArduinoAvr, TheWatchdogIsAPromiseOfTheCallingLoop) {
    play_loop(3);
    wdt_enable(WDTO_2S);
    EXPECT_EQ(board().promises[3], 2s);
    wdt_enable(WDTO_15MS);
    EXPECT_EQ(board().promises[3], 16ms);
    wdt_enable(WDTO_8S);
    EXPECT_EQ(board().promises[3], 8s);
    wdt_disable();
    EXPECT_EQ(board().promises[3], 0s);
}

TEST_F(ArduinoAvr, BusyWaitsAreNeverShort) {
    const auto began = board().now;
    _delay_us(1.5);
    EXPECT_GE(board().now - began, 1500ns);
    _delay_ms(0.25);
    EXPECT_GE(board().now - began, 251'500ns);
    EXPECT_EQ(board().slept_ns, 0);
}

// ---- the C library
// ---------------------------------------------------------------------------------

TEST_F(ArduinoAvr, CheckSumsHaveTheCataloguesCheckValues) {
    std::uint16_t arc = 0, modbus = 0xffff, mcrf = 0xffff, xmodem = 0;
    std::uint8_t maxim = 0, smbus = 0;
    for (const char c : {'1', '2', '3', '4', '5', '6', '7', '8', '9'}) {
        const auto byte = static_cast<std::uint8_t>(c);
        arc = _crc16_update(arc, byte);
        modbus = _crc16_update(modbus, byte);
        mcrf = _crc_ccitt_update(mcrf, byte);
        xmodem = _crc_xmodem_update(xmodem, byte);
        maxim = _crc_ibutton_update(maxim, byte);
        smbus = _crc8_ccitt_update(smbus, byte);
    }
    EXPECT_EQ(arc, 0xbb3d);
    EXPECT_EQ(modbus, 0x4b37);
    EXPECT_EQ(mcrf, 0x6f91);
    EXPECT_EQ(xmodem, 0x31c3);
    EXPECT_EQ(maxim, 0xa1);
    EXPECT_EQ(smbus, 0xf4);
}

TEST_F(ArduinoAvr, NumbersAsText) {
    char text[40];
    EXPECT_STREQ(itoa(-2147483647 - 1, text, 10), "-2147483648");
    EXPECT_STREQ(itoa(-1, text, 16), "ffffffff");
    EXPECT_STREQ(utoa(0, text, 2), "0");
    EXPECT_STREQ(ultoa(4294967295UL, text, 2), "11111111111111111111111111111111");
    EXPECT_STREQ(ltoa(35, text, 36), "z");
    EXPECT_STREQ(itoa(5, text, 1), "");
    EXPECT_STREQ(itoa(5, text, 37), "");
    EXPECT_STREQ(dtostrf(-1.005, -8, 1, text), "-1.0    ");
    for (int base = 2; base <= 36; ++base) {
        for (const unsigned value : {0u, 1u, 35u, 36u, 65535u, 4294967295u})
            EXPECT_EQ(std::strtoul(utoa(value, text, base), nullptr, base), value) << base;
    }
}

TEST_F(ArduinoAvr, CopiesOfBoundedLength) {
    char text[6] = "";
    EXPECT_EQ(strlcpy(text, "hello world", sizeof text), 11u);
    EXPECT_STREQ(text, "hello");
    EXPECT_EQ(strlcpy(text, "ab", sizeof text), 2u);
    EXPECT_EQ(strlcat(text, "cdefgh", sizeof text), 8u);
    EXPECT_STREQ(text, "abcde");
    EXPECT_EQ(strlcat(text, "x", 3), 4u);  // no end within 3: nothing is touched
    EXPECT_STREQ(text, "abcde");
}

// ---- C's half
// ----------------------------------------------------------------------------------------

TEST_F(ArduinoAvr, CHasTheSameWords) {
    const double words[] = {LOW,
                            HIGH,
                            CHANGE,
                            FALLING,
                            RISING,
                            INPUT,
                            OUTPUT,
                            INPUT_PULLUP,
                            INPUT_PULLDOWN,
                            LSBFIRST,
                            MSBFIRST,
                            DEC,
                            HEX,
                            OCT,
                            BIN,
                            PI,
                            HALF_PI,
                            TWO_PI,
                            EULER,
                            DEFAULT,
                            EXTERNAL,
                            INTERNAL,
                            DEG_TO_RAD,
                            RAD_TO_DEG,
                            OUTPUT_OPENDRAIN,
                            A0,
                            A1,
                            A2,
                            A3,
                            A4,
                            A5,
                            A6,
                            A7,
                            SS,
                            MOSI,
                            MISO,
                            SCK,
                            SDA,
                            SCL,
                            LED_BUILTIN,
                            NUM_DIGITAL_PINS};
    ASSERT_EQ(std::size(words), c_word_count);
    for (unsigned i = 0; i < c_word_count; ++i) EXPECT_DOUBLE_EQ(words[i], c_words[i]) << i;
}

TEST_F(ArduinoAvr, WhatOtherHeadersOfAvrLibcHave) {
    EXPECT_EQ(parity_even_bit(0x07), 1);
    EXPECT_EQ(parity_even_bit(0x81), 0);
    constexpr unsigned BAUD = 9600;
    EXPECT_EQ(UBRR_VALUE, 103U) << "ATmega2560's data sheet, table of 16 MHz";
    EXPECT_EQ(TW_MT_DATA_ACK, 0x28);
    EXPECT_EQ(boot_signature_byte_get(2), 0x98);
    power_adc_disable();
    power_all_enable();
    clock_prescale_set(clock_div_4);
    EXPECT_EQ(clock_prescale_get(), clock_div_1);
    int value = 5;
    cbi(value, 0);
    sbi(value, 1);
    EXPECT_EQ(value, 6);
    const qduino::Instant from = board().now;
    _delay_loop_2(4000);  // 1 ms at 16 MHz
    EXPECT_EQ(board().now - from, qduino::Nanoseconds{1'000'000});
    _delay_loop_1(0);  // 48 µs
    EXPECT_EQ(board().now - from, qduino::Nanoseconds{1'048'000});
}

TEST_F(ArduinoAvr, CCallsTheSameFunctions) {
    EXPECT_EQ(c_half_works(7), 5000u + 300u + 7u + 2u);
    EXPECT_EQ(board().modes[7], qduino::board::PinMode::output);
    EXPECT_EQ(levels_written(7), (std::vector<int>{1, 0}));
}

}  // namespace
}  // namespace avr_test
