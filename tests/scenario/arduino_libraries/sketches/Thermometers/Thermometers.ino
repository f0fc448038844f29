#include <BusThermometer.h>

OneLineBus bus(4);
BusThermometer thermometers(&bus);

void report(const byte* rom) {
    for (int i = 0; i < 8; i++) {
        if (rom[i] < 16) Serial.print('0');
        Serial.print(rom[i], HEX);
    }
    Serial.print(OneLineBus::crc8(rom, 7) == rom[7] ? " " : " damaged ");
    Serial.println(thermometers.celsius(rom), 4);
}

void setup() {
    Serial.begin(9600);
    byte rom[8], last[8];
    for (byte round = 0; round < 2; round++) {
        bus.reset_search();
        while (bus.search(rom)) {
            report(rom);  // 85 degrees at first: nothing was measured
            memcpy(last, rom, 8);
        }
        thermometers.request();
    }
    thermometers.set_resolution(9);
    thermometers.request();
    report(last);
    last[3] ^= 1;
    Serial.println(thermometers.celsius(last));  // nobody has this address
}
void loop() { delay(1000); }
