// Devices that never interrupt, and are served all the same: at instants that they name, or because
// a loop asks. Each makes a pulse where it is served.
//
//   DISK   each 10 ms, on an I/O VCPU        pin 2
//   SPI    each 20 ms, above every loop      pin 3
//   I2C    when loop 1 asks, on pin 4        pin 5

#include <atomic>

#include "board/metal/core/device_interrupts.h"
#include "board/metal/machine/tsc_clock.h"

using namespace qduino::board::metal;
using qduino::board::DeviceClass;

class Pulser final : public Device {
 public:
  Pulser(int pin, int period_ms) : pin_(pin), period_(period_ms) {}
  void quiet() override { turn_.store(qduino::kForever); }
  void serve() override {
    digitalWrite(pin_, HIGH);
    digitalWrite(pin_, LOW);
    if (period_.count() > 0) turn_.store(tsc_clock.now() + period_);
  }
  qduino::Instant next_turn() const override { return turn_.load(); }
  void begin(DeviceClass kind) {
    pinMode(pin_, OUTPUT);
    device_interrupts.add(*IoApic::of_machine(), kind, 11, *this);
    if (period_.count() > 0) turn_.store(qduino::kEpoch);
  }

 private:
  int pin_;
  std::chrono::milliseconds period_;
  std::atomic<qduino::Instant> turn_{qduino::kForever};
};

Pulser disk(2, 10), spi(3, 20), i2c(5, 0);

void setup() {
  Serial.begin(115200);
  pinMode(4, OUTPUT);
  disk.begin(DeviceClass::disk);
  spi.begin(DeviceClass::spi);
  i2c.begin(DeviceClass::i2c);
  interruptsVcpu(DISK, 1, 20, 0);
  interruptsVcpu(I2C, 1, 40, 0);
}

void loop(1, 1, 10, 0) {
  digitalWrite(4, HIGH);
  device_interrupts.ask(i2c);
  digitalWrite(4, LOW);
  waitForNextPeriod();
}
