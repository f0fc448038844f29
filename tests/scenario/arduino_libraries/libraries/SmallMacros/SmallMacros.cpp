#include "SmallMacros.h"

void SmallMacros::say() {
    char number[34];
    strlcpy(packet_, "more than the packet can ever hold", sizeof packet_);
    out_.println(packet_);
    out_.println(_BV(5) | _BV(0));
    out_.println(clockCyclesToMicroseconds(microsecondsToClockCycles(40UL)));
    out_.println(itoa(-1234, number, 10));
    out_.println(utoa(43981, number, 16));
    out_.println(dtostrf(3.14159, 8, 3, number));
    sprintf_P(number, PSTR("%d"), 7);
    out_.println(number);
}
