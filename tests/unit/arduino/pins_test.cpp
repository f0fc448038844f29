// Pins, time, pulses, shift registers and tones, as edges on a virtual board.
#include "arduino/Arduino.h"
#include "arduino/libraries/Servo/Servo.h"
#include "tests/unit/arduino/arduino_fixture.h"

using qduino::fake::levels_written;
using qduino::fake::PinEvent;

namespace pins_test {
namespace {

class ArduinoPins : public ArduinoTest {
  protected:
    void SetUp() override {
        ArduinoTest::SetUp();
        noTone(7);  // what the test before asked for
        noTone(8);
        noTone(9);
    }
};

TEST_F(ArduinoPins, ModesReachTheBoard) {
    pinMode(3, OUTPUT);
    pinMode(4, INPUT_PULLUP);
    pinMode(5, INPUT);
    EXPECT_EQ(board().modes[3], qduino::board::PinMode::output);
    EXPECT_EQ(board().modes[4], qduino::board::PinMode::input_pullup);
    EXPECT_EQ(board().modes[5], qduino::board::PinMode::input);
    pinMode(6, 99);
    EXPECT_FALSE(board().modes.contains(6));
    EXPECT_EQ(errors(), std::vector<std::string>{"pinMode(6)"});
}

TEST_F(ArduinoPins, APinThatIsNotThereIsReportedAndIgnored) {
    digitalWrite(128, HIGH);
    digitalWrite(-1, HIGH);
    EXPECT_EQ(digitalRead(1000), LOW);
    EXPECT_TRUE(board().writes.empty());
    EXPECT_EQ(errors().size(), 3U);
}

TEST_F(ArduinoPins, AnythingButLowIsHigh) {
    digitalWrite(2, 42);
    digitalWrite(2, false);
    EXPECT_EQ(levels_written(2), (std::vector<int>{1, 0}));
}

TEST_F(ArduinoPins, AnalogReadCutsToTheResolution) {
    board().analog_of = [](int pin) { return pin == A2 ? 0.5 : 1.0; };
    EXPECT_EQ(analogRead(A2), 512);
    EXPECT_EQ(analogRead(2), 512) << "a channel number and its pin are the same input";
    EXPECT_EQ(analogRead(A3), 1023);
    analogReadResolution(12);
    EXPECT_EQ(analogRead(A2), 2048);
    EXPECT_EQ(analogRead(A3), 4095);
    analogReadResolution(10);
    EXPECT_EQ(analogRead(99), 0);
    EXPECT_EQ(errors(), std::vector<std::string>{"analogRead(99)"});
}

TEST_F(ArduinoPins, AnalogWriteIsADutyAndDigitalWriteEndsIt) {
    analogWrite(9, 51);
    analogWrite(9, 300);
    analogWrite(9, -4);
    ASSERT_EQ(board().pwm.size(), 3U);
    EXPECT_DOUBLE_EQ(board().pwm[0].duty, 0.2);
    EXPECT_DOUBLE_EQ(board().pwm[1].duty, 1.0);
    EXPECT_DOUBLE_EQ(board().pwm[2].duty, 0.0);
    digitalWrite(9, HIGH);
    EXPECT_EQ(board().pwm.size(), 4U);
    digitalWrite(9, LOW);
    EXPECT_EQ(board().pwm.size(), 4U);
    EXPECT_EQ(levels_written(9), (std::vector<int>{1, 0}));
}

TEST_F(ArduinoPins, TheTimeOfASketchCountsFromItsStart) {
    board().now += 5s;  // the computer has run for a while
    const qduino::runtime::Runtime later{qduino::fake::board()};
    board().now += 20ms;
    EXPECT_EQ(millis(), 20UL);
    EXPECT_EQ(micros(), 20'000UL);
    EXPECT_EQ(nanos(), 5'020'000'000ULL);  // the board's clock, as delayBusyUntil() takes it
}

TEST_F(ArduinoPins, DelaysSleepOrSpinExactly) {
    delay(20);
    EXPECT_EQ(board().slept_ns, 20'000'000);
    EXPECT_EQ(board().spun_ns, 0);
    delayMicroseconds(30);
    delayBusyMicroseconds(5);
    delayBusyNanoseconds(700);
    EXPECT_EQ(board().spun_ns, 35'700);
    EXPECT_EQ(millis(), 20UL);
    EXPECT_EQ(micros(), 20'035UL);
    EXPECT_EQ(nanos(), 20'035'700ULL);
    delayBusyUntil(timeNow() + 300ns);
    EXPECT_EQ(nanos(), 20'036'000ULL);
    delayBusyUntil(20'037'000ULL);
    EXPECT_EQ(nanos(), 20'037'000ULL);
    delayBusyUntil(qduino::kEpoch);  // passed: at once
    EXPECT_EQ(nanos(), 20'037'000ULL);
}

TEST_F(ArduinoPins, ADelayPastTheEndOfTimeIsLongAndNotNegative) {
    delay(~0UL);
    EXPECT_GT(board().now, qduino::kEpoch + std::chrono::hours{24 * 365 * 100});
}

TEST_F(ArduinoPins, ShiftOutWritesEachBitBeforeItsClock) {
    shiftOut(7, 8, MSBFIRST, 0b11000101);
    std::vector<int> data;
    int clock_edges = 0;
    for (std::size_t i = 0; i < board().writes.size(); ++i) {
        const PinEvent& event = board().writes[i];
        if (event.pin == 8 && event.level == 1) {
            ++clock_edges;
            ASSERT_EQ(board().writes[i - 1].pin, 7);
            data.push_back(board().writes[i - 1].level);
        }
    }
    EXPECT_EQ(clock_edges, 8);
    EXPECT_EQ(data, (std::vector<int>{1, 1, 0, 0, 0, 1, 0, 1}));
    qduino::fake::reset();
    shiftOut(7, 8, LSBFIRST, 0b11000101);
    EXPECT_EQ(levels_written(7), (std::vector<int>{1, 0, 1, 0, 0, 0, 1, 1}));
    EXPECT_EQ(levels_written(8).back(), 0) << "the clock rests low";
}

TEST_F(ArduinoPins, ShiftInReadsWhileTheClockIsHigh) {
    // A register that shifts out 1,0,1,1,0,0,1,0 on the rising edges of pin 8.
    board().level_of = [](int, qduino::Instant) {
        static const int bits[] = {1, 0, 1, 1, 0, 0, 1, 0};
        const auto clock = levels_written(8);
        const auto rising = std::count(clock.begin(), clock.end(), 1);
        return clock.empty() || clock.back() == 0 ? 0 : bits[rising - 1];
    };
    EXPECT_EQ(shiftIn(7, 8, MSBFIRST), 0b10110010);
    board().writes.clear();
    EXPECT_EQ(shiftIn(7, 8, LSBFIRST), 0b01001101);
}

TEST_F(ArduinoPins, PulseInMeasuresTheNextWholePulse) {
    board().level_of = [](int, qduino::Instant now) {
        const auto us = qduino::to_ns(now) / 1000;
        // The end of one pulse, then a whole one of 1.5 ms.
        return us < 50 || (us >= 200 && us < 1700) ? 1 : 0;
    };
    const unsigned long width_us = pulseIn(4, HIGH);
    EXPECT_GE(width_us, 1499UL);
    EXPECT_LE(width_us, 1501UL);
}

TEST_F(ArduinoPins, PulseInOfALowPulse) {
    board().level_of = [](int, qduino::Instant now) {
        const auto us = qduino::to_ns(now) / 1000;
        return us >= 100 && us < 400 ? 0 : 1;
    };
    EXPECT_EQ(pulseInLong(4, LOW), 300UL);
}

TEST_F(ArduinoPins, PulseInGivesUpWithZero) {
    EXPECT_EQ(pulseIn(4, HIGH, 5000), 0UL);
    EXPECT_EQ(micros(), 5000UL);
    board().level_of = [](int, qduino::Instant) { return 1; };  // began before, never ends
    EXPECT_EQ(pulseIn(4, HIGH, 5000), 0UL);
    EXPECT_EQ(micros(), 10000UL);
}

/// The loop that tone() brings with it; a sketch with tone() has it in its table.
const qduino::runtime::LoopDeclaration& tone_loop() {
    for (const auto& declaration : qduino::runtime::sketch_table().loops) {
        if (std::string(declaration.file) == "tone()") return declaration;
    }
    ADD_FAILURE() << "no loop for tone()";
    return qduino::runtime::sketch_table().loops[0];
}

/// Its passes, for so long.
void run_tone_loop(unsigned long ms) {
    for (const unsigned long end = millis() + ms; millis() < end;) tone_loop().body();
}

TEST_F(ArduinoPins, AToneIsASquareWaveOnALoopOfItsOwn) {
    EXPECT_EQ(tone_loop().id, 32);
    EXPECT_EQ(tone_loop().budget, 500us);
    tone(8, 440, 100);
    EXPECT_TRUE(board().writes.empty()) << "tone() itself returns at once";
    run_tone_loop(110);
    const auto& writes = board().writes;
    // 89 half-periods of 1.136363 ms begin in 100 ms, and the pin is left low.
    ASSERT_EQ(writes.size(), 90U);
    EXPECT_EQ(writes.back().level, 0);
    EXPECT_EQ(writes.back().at_ns, 100'000'000);
    for (std::size_t i = 1; i + 1 < writes.size(); ++i) {
        EXPECT_EQ(writes[i].at_ns - writes[i - 1].at_ns, 1'136'363);
        EXPECT_NE(writes[i].level, writes[i - 1].level);
    }
    board().writes.clear();
    play_loop(32);
    run_tone_loop(50);
    EXPECT_TRUE(board().writes.empty()) << "a tone is played once";
    EXPECT_FALSE(runtime_.loop(32)->waited) << "it has no periods to keep";
}

TEST_F(ArduinoPins, TheTemperatureOfTheProcessorIsTheBoards) {
    board().chip_celsius = 48.5;
    EXPECT_FLOAT_EQ(analogReadTemp(), 48.5F);
    board().refuse_everything = true;
    EXPECT_TRUE(std::isnan(analogReadTemp()));
    EXPECT_EQ(errors(), std::vector<std::string>{"analogReadTemp(0)"});
}

TEST_F(ArduinoPins, AToneNeedsNoPinMode) {
    tone(7, 1000, 1);
    EXPECT_EQ(board().modes[7], qduino::board::PinMode::output);
}

TEST_F(ArduinoPins, NoToneEndsIt) {
    board().while_sleeping = [] {
        if (millis() >= 10) noTone(8);
    };
    tone(8, 1000);
    run_tone_loop(20);
    EXPECT_EQ(levels_written(8).back(), 0);
    EXPECT_GE(board().writes.back().at_ns, 9'000'000);
    EXPECT_LE(board().writes.back().at_ns, 11'000'000);
}

TEST_F(ArduinoPins, ASecondPinWaitsForTheFirst) {
    tone(8, 1000, 50);
    tone(9, 1000, 50);  // ignored: pin 8 sounds
    run_tone_loop(60);
    EXPECT_TRUE(levels_written(9).empty());
    EXPECT_FALSE(levels_written(8).empty());
    tone(9, 1000, 5);  // pin 8 has ended
    run_tone_loop(10);
    EXPECT_FALSE(levels_written(9).empty());
    tone(9, 3);
    EXPECT_EQ(errors(), std::vector<std::string>{"tone(9)"});
}

TEST_F(ArduinoPins, ServoAnglesAreWidths) {
    Servo servo;
    servo.write(90);
    EXPECT_TRUE(board().pwm.empty()) << "not attached yet";
    EXPECT_EQ(servo.attach(10), 10);
    ASSERT_EQ(board().pwm.size(), 1U);
    EXPECT_DOUBLE_EQ(board().pwm[0].duty, 1472.0 / 20000);
    EXPECT_EQ(board().pwm_periods, (std::vector<qduino::fake::PwmPeriod>{{10, 20'000'000}}));
    for (int angle = 0; angle <= 180; ++angle) {
        servo.write(angle);
        EXPECT_EQ(servo.read(), angle);
    }
    servo.write(1500);
    EXPECT_EQ(servo.readMicroseconds(), 1500);
    servo.writeMicroseconds(9999);
    EXPECT_EQ(servo.readMicroseconds(), 2400);
    servo.write(-20);
    EXPECT_EQ(servo.readMicroseconds(), 544);
    servo.detach();
    EXPECT_FALSE(servo.attached());
    EXPECT_DOUBLE_EQ(board().pwm.back().duty, 0.0);
    EXPECT_EQ(board().pwm_periods.back(), (qduino::fake::PwmPeriod{10, 0})) << "the board's own again";
    EXPECT_EQ(servo.attach(500), INVALID_SERVO);
}

TEST_F(ArduinoPins, AServoNeedsAPinWhosePwmCanDoIt) {
    board().refuse_everything = true;
    Servo servo;
    EXPECT_EQ(servo.attach(10), INVALID_SERVO);
    EXPECT_FALSE(servo.attached());
    EXPECT_TRUE(board().pwm.empty());
    EXPECT_EQ(errors(), std::vector<std::string>{"Servo.attach(10)"});
}

TEST_F(ArduinoPins, AnalogWriteHasTheFrequencyThatItIsGiven) {
    analogWriteFrequency(9, 980);
    analogWriteFrequency(9, 0.5);
    analogWriteFrequency(9, 2e6);
    analogWriteFrequency(9, 0);
    EXPECT_EQ(board().pwm_periods, (std::vector<qduino::fake::PwmPeriod>{{9, 1'020'408}, {9, 0}}));
    EXPECT_EQ(errors().size(), 2U);
}

TEST_F(ArduinoPins, InSetupAToneSoundsDuringDelays) {
    tone(8, 1000, 10);
    delay(4);
    EXPECT_EQ(levels_written(8).size(), 8U);
    EXPECT_EQ(millis(), 4UL);
    board().vcpu = 1;
    delay(2);  // in a loop a delay is a delay
    EXPECT_EQ(levels_written(8).size(), 8U);
    board().vcpu = qduino::board::kNoVcpu;
    delay(20);
    EXPECT_EQ(millis(), 26UL);
    ASSERT_FALSE(board().writes.empty());
    EXPECT_LE(board().writes.back().at_ns, 10'000'000);
    for (std::size_t i = 1; i < board().writes.size(); ++i) {
        EXPECT_GE(board().writes[i].at_ns - board().writes[i - 1].at_ns, 500'000)
            << "late edges are not bunched";
    }
    EXPECT_EQ(levels_written(8).back(), 0);
}

TEST_F(ArduinoPins, AToneOfNoFrequencyIsARest) {
    tone(8, 1000);
    tone(8, 0, 50);  // as a melody has between its notes
    tone_loop().body();
    EXPECT_TRUE(board().writes.empty());
    EXPECT_TRUE(errors().empty());
}

}  // namespace
}  // namespace pins_test
