#include "SerialGps.h"

void SerialGps::begin(long baud) { port_.begin(baud); }

bool SerialGps::ask() {
    port_.print("$PMTK605*31\r\n");
    port_.flush();
    return port_.isListening() && !port_.overflow();
}
