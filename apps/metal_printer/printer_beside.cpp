// The printer as an image for one core that Linux gives up: the printer of sketches/printer, with
// its loops on that core, and its link where Linux's side finds it (beside/link_relay.h).
//
//   core 1   ▐███ loop 2 ███▌ 1, 3 ▐███ loop 2 ███▌ 1, 3 ▐███       loop 2: 300 of each 500 us
//
// One core has to do for the loops that have two elsewhere. A pulse that is due in the gaps waits
// for up to 200 us, and the print's time line moves by that. The part is the same; it takes longer.
// Shorter gaps would be better, but each costs the kernel's passes, which admission counts.
#include <QduinoMC.h>

#include "Printer.h"
#include "PrinterWiring.h"
#include "board/metal/computer/instructions.h"
#include "board/metal/linux_side.h"
#include "board/metal/panic.h"

namespace qduino::apps::metal {
namespace {

using printer::link::LinkLayout;

/// What the launcher zeroed for it. The magic number is written last: Linux's side looks for it.
LinkLayout& make_link() {
    auto& area = board::metal::linux_side.area();
    const auto at = reinterpret_cast<std::uintptr_t>(&area) + board::kBesideServiceOffset;
    LinkLayout& link = *reinterpret_cast<LinkLayout*>(at);
    link.version = printer::link::kVersion;
    link.size = sizeof link;
    link.session = board::metal::clock_count() | 1;
    link.magic.store(printer::link::kMagic, std::memory_order_release);
    return link;
}

Printer printer;

}  // namespace
}  // namespace qduino::apps::metal

using qduino::apps::metal::printer;

TIME_UNIT(us);

void setup() {
    if (!qduino::board::metal::linux_side.exists())
        qduino::board::metal::panic("this image runs beside Linux: qduino metal beside");
    qduino::sketches::printer_wiring() = {
        .config = {}, .link = &qduino::apps::metal::make_link(), .measure_steps = true};
    printer.begin();
    promiseProgress(1, 2000000);
    promiseProgress(2, 1000000);
    promiseProgress(3, 1000000);
}

void loop(2, 300, 500, 1) { printer.step(); }

void loop(1, 12000, 100000, 1) {
    printer.plan();
    waitForNextPeriod();
}

void loop(3, 1000, 8000, 1) {
    printer.heat();
    waitForNextPeriod();
}

QDUINO_SKETCH(&setup, nullptr);
