#include <IRremote.hpp>

bool sent = false;

void setup() {
    Serial.begin(9600);
    IrReceiver.begin(7, ENABLE_LED_FEEDBACK);
    IrSender.begin(8);
}

void loop() {
    if (IrReceiver.decode()) {
        if (IrReceiver.decodedIRData.protocol == NEC) IrReceiver.printIRResultShort(&Serial);
        Serial.println(IrReceiver.irparams.rawlen);  // a pause, and each mark and space
        IrReceiver.resume();
    }
    if (!sent && millis() > 1000) {
        IrSender.sendNEC(0x1234, 0x56, 1);  // the module sees its light
        sent = true;
    }
    delay(5);
}
