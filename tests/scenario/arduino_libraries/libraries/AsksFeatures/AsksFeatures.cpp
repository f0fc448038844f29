#include "AsksFeatures.h"

const char* AsksFeatures::transfer(uint8_t value) {
#ifdef SPI_HAS_TRANSACTION
    SPI.beginTransaction(SPISettings(1000000, MSBFIRST, SPI_MODE0));
#else
    SPI.setClockDivider(SPI_CLOCK_DIV16);
#endif
    SPI.transfer(value);
#ifdef SPI_HAS_TRANSACTION
    SPI.endTransaction();
    return "a transaction";
#else
    return "as in 2013";
#endif
}
