// Names of ArduinoCore-API, which newer boards have.
#include <Arduino_CAN.h>
#include <Ethernet.h>
#include <RingBuffer.h>

arduino::String text;
arduino::RingBufferN<4> ring;

void setup() {
    Serial.begin(9600);
    IPAddress address;
    const uint8_t bytes[4] = {10, 0, 0, 7};
    address = bytes;
    Serial.println(address);
    address.fromString("2001:db8:0:0:1::7");
    Serial.println(address);
    for (int i = 0; i < 9; i++) ring.store_char('a' + i);
    while (ring.available()) text += char(ring.read_char());
    Serial.println(text);
    const uint8_t data[] = {0xCA, 0xFE};
    Serial.println(CanMsg(CanStandardId(0x123), sizeof data, data));
    Serial.println(CAN.begin(CanBitRate::BR_250k) ? "bus" : "no bus");
}
void loop() { delay(1000); }
