// CAN: the computer's CAN bus, through the kernel's SocketCAN. The interface is `can0`, or what
// QDUINO_CAN names. Its bit rate is the host's business, as a network's is:
//
//   ip link set can0 up type can bitrate 500000
//
// In the simulator it reaches the real bus. A machine without Linux has none.
#pragma once

#include "arduino/libraries/CAN/HardwareCAN.h"

extern HardwareCAN& CAN;
