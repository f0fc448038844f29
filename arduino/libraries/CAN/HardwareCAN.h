// HardwareCAN: a port on a CAN bus. (As in ArduinoCore-API.) Arduino_CAN.h has the computer's.
#pragma once

#include "arduino/libraries/CAN/CanMsg.h"
#include "arduino/libraries/CAN/CanMsgRingbuffer.h"

enum class CanBitRate : int { BR_125k = 125000, BR_250k = 250000, BR_500k = 500000, BR_1000k = 1000000 };

inline constexpr int CAN_SUCCESS = 1;
inline constexpr int CAN_ERROR_GENERIC = -1;

class HardwareCAN {
  public:
    virtual ~HardwareCAN() = default;

    /// Setup-time. False, and reported, when the port cannot be used.
    virtual bool begin(CanBitRate bit_rate) = 0;
    virtual void end() = 0;
    /// Hands `msg` over to be sent: CAN_SUCCESS, or a negative number. Frames leave in order.
    virtual int write(const CanMsg& msg) = 0;
    /// Frames that have come and were not read.
    virtual std::size_t available() = 0;
    /// The oldest of them, taken out; an empty one when none is there.
    virtual CanMsg read() = 0;
};

namespace arduino {
using ::HardwareCAN;
}  // namespace arduino
