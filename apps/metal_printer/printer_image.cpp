// The web-connected printer as an image: the printer's sketch as it is (sketches/printer), and in
// the place of the print service one loop more, at the other end of the same link.
//
//   network ◄─► [loop 4: HTTP, the job in memory] ◄─link─► [loops 1, 2, 3] ◄─► pins (pins_window.h)
//
//   key=K      the key that requests carry; without it one is made, and said on the serial line
#include <QduinoMC.h>
#include <WiFi.h>

#include <string>

#include "PrinterWiring.h"
#include "apps/metal_printer/memory_spool.h"
#include "apps/metal_printer/web_server.h"
#include "arduino/metal/loader_words.h"
#include "base/text.h"
#include "board/board.h"
#include "board/metal/computer/instructions.h"
#include "board/metal/driver/emulator_files.h"
#include "board/metal/panic.h"

namespace qduino::apps::metal {
namespace {

constexpr std::uint16_t kPort = 80;

printer::link::LinkLayout link;

/// Sixteen hexadecimal digits of the processor's random numbers, or of its clock where it has none.
std::string random_digits() {
    std::uint64_t number = board::metal::clock_count();
    asm volatile("rdrand %0" : "+r"(number) : : "cc");
    std::string digits;
    write_characters(digits, number, 16);
    return digits;
}

/// The browser's side, as the emulator hands it over (web/ui/dist); none elsewhere.
web::StaticFiles page_files() {
    web::StaticFiles::Found found;
    for (board::metal::EmulatorFile& file : board::metal::emulator_files("opt/qduino/"))
        found[file.name] = std::move(file.bytes);
    return web::StaticFiles{found};
}

/// Before setup(): it takes the wiring.
struct Wired {
    Wired() {
        link.version = printer::link::kVersion;
        link.size = sizeof link;
        link.session = board::metal::clock_count() | 1;
        link.magic.store(printer::link::kMagic);
        sketches::printer_wiring() = {.config = {}, .link = &link, .measure_steps = true};
    }
} wired;

/// The print service.
class Service {
  public:
    Service()
        : spool_(link, sketches::printer_wiring().config),
          server_(spool_, key_, random_digits() + random_digits(), page_files()) {}

    void step() {
        const Instant now = board::current().now();
        spool_.tick(now);
        if (!listens_) return listen();
        server_.serve(now);
    }

  private:
    /// Once the network has an address.
    void listen() {
        if (WiFi.status() != WL_CONNECTED) return;
        const Result<void> listening = server_.listen(kPort);
        listens_ = listening.ok();
        board::metal::report(listens_ ? text<std::string>("printer: listens on port ", kPort, ", key ", key_,
                                                          ". Jobs are kept in memory alone.\n")
                                      : text<std::string>("printer: ", listening.error().message, '\n'));
    }

    std::string key_ =
        arduino::metal::loader_word("key").empty() ? random_digits() : arduino::metal::loader_word("key");
    MemorySpool spool_;
    WebServer server_;
    bool listens_ = false;
};

}  // namespace
}  // namespace qduino::apps::metal

// The paper's default VCPU is 10 of 100 ms; an emulated processor is slow.
void loop(4, 30, 100, 0) {
    static qduino::apps::metal::Service service;
    service.step();
    waitForNextPeriod();
}
