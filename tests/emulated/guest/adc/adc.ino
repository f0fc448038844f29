// Reads all channels of an ADS7828 over the board's real I2C bus, three times, and looks for chips
// that are not there, while another loop owns core 1.

#include <Wire.h>
#include <signal.h>
#include <unistd.h>

#include "device/ads7828.h"

namespace ads7828 = qduino::device::ads7828;

// −1: nothing came.
int readChannel(int channel) {
  Wire.beginTransmission(ads7828::kFirstAddress);
  Wire.write(ads7828::command_byte(channel));
  Wire.endTransmission(false);
  if (Wire.requestFrom(ads7828::kFirstAddress, 2) != 2) return -1;
  const uint8_t high = Wire.read();
  const uint8_t bytes[2] = {high, static_cast<uint8_t>(Wire.read())};
  return ads7828::decode(bytes);
}

void scan() {
  for (int address = 0x47; address <= 0x49; ++address) {
    Wire.beginTransmission(address);
    Serial.print("sketch: address ");
    Serial.print(address);
    Serial.print(" answers ");
    Serial.println(Wire.endTransmission());
  }
}

void setup() {
  Serial.begin(115200);
  Wire.begin();
  scan();
}

void loop(1, 10, 100, 0) {
  static int round = 0;
  for (int channel = 0; channel < ads7828::kChannelCount; ++channel) {
    Serial.print("sketch: channel ");
    Serial.print(channel);
    Serial.print(" reads ");
    Serial.println(readChannel(channel));
  }
  if (++round == 3) kill(getpid(), SIGTERM);
  waitForNextPeriod();
}

volatile unsigned long passes = 0;

void loop(2, 1, 1, 1) {
  delayBusyMicroseconds(100);
  passes = passes + 1;
}
