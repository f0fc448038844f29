// A sketch that does everything at once from two loops that share a core: a bus, a serial port, a
// ring, and a tone.
#include <Arduino.h>
#include <SPI.h>

#include "arduino/core/loops.h"
#include "tests/unit/arduino/on_sim_sketch.h"

RingBuffer<int, 3> numbers;
std::vector<int> received;
int chip_selects[2] = {10, 11};
volatile int wheel_edges = 0;
int level_of_wheel_before_setup = -1;
int looks_before_setup = 0;

namespace {

void count_edge() { wheel_edges = wheel_edges + 1; }

/// A library's object: its constructor uses pins and an interrupt before there is a board.
struct Wheel {
    Wheel(int sensor, int lamp) {
        pinMode(lamp, OUTPUT);
        digitalWrite(lamp, HIGH);
        pinMode(sensor, INPUT_PULLUP);
        level_of_wheel_before_setup = digitalRead(sensor);
        attachInterrupt(digitalPinToInterrupt(sensor), count_edge, CHANGE);
        for (int twice = 0; twice < 2; ++twice) qduino::arduino::before_setup([] { ++looks_before_setup; });
    }
} wheel(21, 20);

/// The first loop's takes so long that releases of the second, which has the higher priority, fall
/// within it.
void use_bus(int who, unsigned long length_us) {
    SPI.beginTransaction(SPISettings(1000000, MSBFIRST, SPI_MODE0));
    digitalWrite(chip_selects[who], LOW);
    SPI.transfer(static_cast<std::uint8_t>(who));
    delayMicroseconds(length_us);
    SPI.transfer(static_cast<std::uint8_t>(who));
    digitalWrite(chip_selects[who], HIGH);
    SPI.endTransaction();
}

}  // namespace

void setup() {
    Serial.begin(115200, SERIAL_8N1, slow_port());
    for (int pin : chip_selects) {
        pinMode(pin, OUTPUT);
        digitalWrite(pin, HIGH);
    }
    tone(8, 1000, 20);
    delay(10);  // half of it sounds here, the rest on the tone loop
}

void loop(1, 8, 40, 0) {
    static int next = 0;
    use_bus(0, 2500);
    Serial.println("the first loop was here");
    if (next < 20) numbers.write(next++);
    waitForNextPeriod();
}

void loop(2, 3, 7, 0) {
    use_bus(1, 500);
    Serial.println("the second loop was here");
    int number;
    if (numbers.tryRead(number)) received.push_back(number);
    waitForNextPeriod();
}

QDUINO_SKETCH(&setup, nullptr);
