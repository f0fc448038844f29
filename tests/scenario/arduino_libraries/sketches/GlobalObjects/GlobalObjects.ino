#include <GlobalMotor.h>

GlobalMotor motor(8, 12);
GlobalSwitch button(4);

void setup() {
    Serial.begin(9600);
    Serial.println(motor.isEnabled() ? "enabled" : "off");
    digitalWrite(9, HIGH);  // an output since its constructor
    Serial.println(digitalRead(9));
    Serial.println(button.wasPressed() ? "pressed" : "released");
    Serial.println(motor.steps(0xFFFFFFFF));
    Serial.println((unsigned)sizeof(ulong));
}
void loop() { delay(1000); }
