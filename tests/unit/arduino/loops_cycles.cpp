// A third, in cycles, which are nanoseconds on this board; without the semicolon, which is not
// needed.
#include <Arduino.h>
#include <SPI.h>

TIME_UNIT(cycles)

void loop(13, 250000, 1000000) {}

void routed_with_an_spi_object() {
    SPI.begin();                      // the object
    interruptsVcpu(SPI, 1000, 2000);  // the device class
    noInterrupts(ALL, 1);
    interrupts(NIC, 1);
    noTimer(1);
    reTimer(1);
    noInterrupts();
    interrupts();
}
