// Devices that never interrupt, and are served all the same: at instants that they name, or because
// a loop asks. Each makes a pulse where it is served.
//
//   DISK   each 10 ms, on an I/O VCPU        pin 2
//   SPI    each 20 ms, above every loop      pin 3
//   I2C    when loop 1 asks, on pin 4        pin 5
//   NIC    when loop 1 asks, 300 times in the middle of its bottom half: more often than the queue
//          of its I/O VCPU takes             pin 8, and pin 7 where two of them overlap

#include <atomic>

#include "board/metal/core/device_interrupts.h"
#include "board/metal/computer/clock.h"

using namespace qduino::board::metal;
using qduino::board::DeviceClass;

void pulse(int pin) {
  digitalWrite(pin, HIGH);
  digitalWrite(pin, LOW);
}

class Pulser final : public Device {
 public:
  Pulser(int pin, int period_ms) : pin_(pin), period_(period_ms) {}
  void quiet() override { turn_.store(qduino::kForever); }
  qduino::Instant next_turn() const override { return turn_.load(); }
  void begin(DeviceClass kind) {
    pinMode(pin_, OUTPUT);
    device_interrupts.add(*interrupt_lines, kind, 11, *this);
    if (period_.count() > 0) turn_.store(qduino::kEpoch);
  }

 private:
  void serve() override {
    pulse(pin_);
    if (period_.count() > 0) turn_.store(computer_clock.now() + period_);
  }
  int pin_;
  std::chrono::milliseconds period_;
  std::atomic<qduino::Instant> turn_{qduino::kForever};
};

/// The first of its bottom halves lasts until it was asked again and again.
class Crowded final : public Device {
 public:
  void quiet() override {}
  void crowd() {
    if (crowded_) return;
    const bool crowds = inside_ > 0;
    for (int i = 0; i < (crowds ? 300 : 1); ++i) device_interrupts.ask(*this);
    crowded_ = crowds;
  }

 private:
  void serve() override {
    if (inside_.fetch_add(1) > 0) {
      pulse(7);
    } else {
      pulse(8);
      while (!crowded_) {
      }
    }
    inside_.fetch_sub(1);
  }
  std::atomic<int> inside_{0};
  std::atomic<bool> crowded_{false};
};

Pulser disk(2, 10), spi(3, 20), i2c(5, 0);
Crowded crowded;

void setup() {
  Serial.begin(115200);
  for (int pin : {4, 7, 8}) pinMode(pin, OUTPUT);
  disk.begin(DeviceClass::disk);
  spi.begin(DeviceClass::spi);
  i2c.begin(DeviceClass::i2c);
  interruptsVcpu(DISK, 1, 20, 0);
  interruptsVcpu(I2C, 1, 40, 0);
  device_interrupts.add(*interrupt_lines, DeviceClass::nic, 11, crowded);
  interruptsVcpu(NIC, 1, 40, 0);
}

void loop(1, 1, 10, 0) {
  digitalWrite(4, HIGH);
  device_interrupts.ask(i2c);
  crowded.crowd();
  digitalWrite(4, LOW);
  waitForNextPeriod();
}
