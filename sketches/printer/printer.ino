// A web-connected 3D printer in three loops, with the budgets of the paper (RTAS 2017, section IV).
//
// Jobs come from the print service through shared memory (printer/link): no loop here touches a
// socket or a disk.
#include <QduinoMC.h>
#include <Wire.h>

#include "Printer.h"

Printer printer;

Chain heating{"thermistors to heaters"};
Chain stopping{"emergency byte to pins"};

void setup() {
    printer.begin();
    interruptsVcpu(I2C, 1, 100, 0);  // the thermistors' bus
    Wire.heldBy(3, 1);               // which loop 3 alone uses
    interruptsVcpu(NIC, 1, 100, 0);  // what the web brings
    const bool port = interruptsVcpu(UART, 2, 100, 0);  // a serial host's bytes
    noInterrupts(ALL, 1);  // core 1 is for the stepper pulses alone
    noTimer(1);
    promiseProgress(1, 2000);
    promiseProgress(2, 1000);
    promiseProgress(3, 1000);
    heating.from("thermistors").through(3).to("heaters").reactsWithin(16).freshWithin(8);
    // Loop 2 waits for no period. It looks for stops first, and is back after a millisecond, and
    // what its wake-up takes.
    if (port) stopping.fromDevice("uart").through(2, 2).to("heaters and motors").reactsWithin(40);
}

// G-code in, steps out, a few seconds ahead of the motors.
void loop(1, 30, 100, 0) {
    printer.plan();
    waitForNextPeriod();
}

// Every pulse at its instant, on a core of its own.
void loop(2, 100us, 100us, 1) {
    printer.step();
}

// Two thermistors, PID, heaters and fan.
void loop(3, 1, 8, 0) {
    printer.heat();
    waitForNextPeriod();
}
