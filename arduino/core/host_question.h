// A question to the host's system: is there a byte, a connection, a file?
//
// In the simulator code takes no time, and a loop that asks such a question over and over would
// ask the host millions of times in each virtual second. So a question takes virtual time there.
// Only those that found nothing are asked here: they are what a loop repeats.
#pragma once

#include "board/board.h"

namespace qduino::arduino {

/// The host was asked for something on `device`, and nothing was there. It took the host about as
/// long as `times` short system calls. Any caller; costs nothing on a real board.
inline void asked_in_vain(board::DeviceClass device, int times = 1) {
    board::Board& board = board::current();
    for (int i = 0; i < times; ++i) board.device_work(device, 0);
}

/// `found`; where it is 0 or less, the question was in vain.
template <typename Count>
Count found_on(board::DeviceClass device, Count found) {
    if (found <= Count{0}) asked_in_vain(device);
    return found;
}

}  // namespace qduino::arduino
