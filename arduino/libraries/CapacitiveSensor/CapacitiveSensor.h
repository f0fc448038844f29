// CapacitiveSensor: touch, from the time that a large resistor takes to charge what is near the
// receiving pin.
//
//   send ──[ 1–40 MΩ ]──┬── receive     send goes high; the charge is counted until receive reads
//                       ╧ finger        high; then both are discharged, and all is done the other
//                                       way round
//
// A reading counts looks at the pin, one every microsecond, so that it depends on the charge and
// not on the speed of the board.
#pragma once

#include "arduino/core/constants.h"

class CapacitiveSensor {
  public:
    CapacitiveSensor(int send_pin, int receive_pin) : send_(send_pin), receive_(receive_pin) {}

    /// The sum over `samples`, less the lowest sum so far (the untouched sensor); -2 when a sample
    /// took longer than the timeout. Spins, consuming budget.
    qduino::arduino::Long capacitiveSensor(int samples);
    /// The sum as it is.
    qduino::arduino::Long capacitiveSensorRaw(int samples);
    /// How long one reading may take, with all its samples; 2 s unless said otherwise.
    void set_CS_Timeout_Millis(unsigned long timeout_ms) { timeout_ms_ = timeout_ms; }
    /// How long the lowest reading is kept before it is found anew; 20 s unless said otherwise.
    void set_CS_AutocaL_Millis(unsigned long interval_ms) { calibrate_ms_ = interval_ms; }
    void reset_CS_AutoCal() { lowest_ = -1; }

  private:
    /// Looks until `receive` reads `level`; false at `give_up_us`.
    bool count_until(int level, unsigned long give_up_us);
    bool sample(unsigned long give_up_us);

    int send_;
    int receive_;
    unsigned long timeout_ms_ = 2000;
    unsigned long calibrate_ms_ = 20000;
    unsigned long calibrated_ms_ = 0;
    long lowest_ = -1;  // -1: not known
    long total_ = 0;
};
