#include <PageDisplay.h>

PageDisplay screen, nobody;

void setup() {
    Serial.begin(9600);
    Serial.println(nobody.begin(0x3D));
    Serial.println(screen.begin(0x3C));
    screen.box(0, 0, 128, 64);
    screen.line(0, 0, 127, 63);
    screen.line(3, 60, 40, 35);
    screen.circle(95, 20, 15);
    screen.display();
    Serial.println("shown");
}
void loop() { delay(1000); }
