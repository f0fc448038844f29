// What the test asks of the run: an emergency stop ends it, and then the emulator writes what it
// has seen. The loader's word "mutant=routed" sends the network's interrupts to core 1, which the
// test has to notice.
#include <QduinoMC.h>

#include "PrinterWiring.h"
#include "arduino/metal/loader_words.h"
#include "board/board.h"

namespace {

bool route_to_core_1() {
    auto& board = qduino::board::current();
    return board.route_interrupts(qduino::board::DeviceClass::nic, 1, true).ok() &&
           board.route_interrupts(qduino::board::DeviceClass::nic, 0, false).ok();
}

}  // namespace

void loop(5, 1, 100, 0) {
    static const bool routed = qduino::arduino::metal::loader_word("mutant") == "routed" && route_to_core_1();
    static_cast<void>(routed);
    static int passes_left = 10;  // the answer goes out meanwhile
    if (qduino::sketches::printer_wiring().link->emergency.load() != 0 && passes_left-- == 0)
        qduino::board::current().request_stop();
    waitForNextPeriod();
}
