#include <SPI.h>
#include <SD.h>

void setup() {
    Serial.begin(9600);
    if (!SD.begin(4)) {
        Serial.println("no card");
        return;
    }
    SD.mkdir("logs/today");
    SD.remove("logs/today/a.csv");
    for (int i = 0; i < 3; i++) {
        File log = SD.open("logs/today/a.csv", FILE_WRITE);
        log.print(i);
        log.print(',');
        log.println(i * i);
        log.close();
    }
    File log = SD.open("logs/today/a.csv");
    while (log.available()) Serial.write(log.read());
    log.close();
    File folder = SD.open("/logs");
    while (File entry = folder.openNextFile()) {
        Serial.print(entry.name());
        Serial.println(entry.isDirectory() ? "/" : "");
    }
    Serial.println(SD.open("logs/../../etc/passwd") ? "out" : "in");
}
void loop() { delay(1000); }
