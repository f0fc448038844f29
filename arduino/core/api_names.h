// ArduinoCore-API keeps its classes in `namespace arduino`, and code for newer boards names them
// so: arduino::String. Here they are the same classes.
#pragma once

#include "arduino/HardwareSerial.h"
#include "arduino/Print.h"
#include "arduino/Printable.h"
#include "arduino/Stream.h"
#include "arduino/WString.h"

namespace arduino {
using ::__FlashStringHelper;
using ::HardwareSerial;
using ::Print;
using ::Printable;
using ::Stream;
using ::String;
}  // namespace arduino
