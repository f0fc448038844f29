// For calls that drive a pin which the sketch may not have set up: tone() is one.
#pragma once

namespace qduino::arduino {

/// pinMode(pin, OUTPUT), unless that was the last mode set. `pin` is a pin of the board.
void make_output(int pin);

}  // namespace qduino::arduino
