// `qduino monitor --tty`: Serial of the uploaded sketch as a serial port, for programs that want
// one: the Arduino IDE's Serial Monitor and plotter, picocom, minicom.
//
//   sketch ── its keeper ══ way ══ this process ══ /dev/pts/N ◄── LINK ◄── the program
//
// The way is open while a program has the port open, and begins anew with each opening. So each
// shows the sketch's last 64 KiB first, and an upload in between ends the sketch and not the port.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"

namespace qduino::apps {

/// Until SIGINT, SIGTERM or SIGHUP: 0. `link` becomes a symbolic link to the port, and goes with
/// it. `host` as for open_way(). Errors: already_exists, `link` is something else; the system's.
[[nodiscard]] Result<int> monitor_tty(const std::filesystem::path& link, const std::string& host);

}  // namespace qduino::apps
