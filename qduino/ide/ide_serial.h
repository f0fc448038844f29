// The serial ports of this board, for the Arduino IDE 1.8: its Serial Monitor opens nothing else.
// Without a device of the kernel's its list of ports is empty, so platform.txt names this tool.
//
//   IDE ── START_SYNC ──► this process ══► qduino monitor --tty LINK      (one for each port)
//       ◄── "add" LINK ──                   /dev/pts/N ◄── LINK ◄── the IDE's Serial Monitor
//
// A port is there from the tool's start to its end: QUIT, the end of stdin, or a signal.
//
// Source: cc/arduino/packages/discoverers/PluggableDiscovery.java and DiscoveryManager.java of
// IDE 1.8.19. That is the protocol of ide_discovery.h without HELLO; a port whose protocol is not
// "network" is opened as a serial one, by its address.
#pragma once

#include "base/result.h"
#include "qduino/common/words.h"

namespace qduino::apps {

/// `hosts` as ssh takes them: a port more for each. Returns 0 at the end. Errors: no state folder;
/// a port cannot be made; stdout has gone.
[[nodiscard]] Result<int> ide_serial(const Words& hosts);

}  // namespace qduino::apps
