#include "FastPin.h"

void FastPin::high() {
#ifdef portOutputRegister
    *port_ |= digitalPinToBitMask(pin_);
#else
    digitalWrite(pin_, HIGH);
#endif
}

const char* FastPin::way() const {
#ifdef portOutputRegister
    return "register";
#else
    return "digitalWrite";
#endif
}
