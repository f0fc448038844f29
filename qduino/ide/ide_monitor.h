// Serial of an uploaded sketch, for the monitor and the plotter of the Arduino IDE 2, and for
// `arduino-cli monitor`.
//
//   IDE ── OPEN 127.0.0.1:4711 PORT ──► this tool ── connects to the IDE, and to the sketch
//    ▲ └──── what is typed ────► TCP ────► serial_way.h ────► sketch
//    └────── TCP ◄──────────────────────── serial_way.h ◄──── Serial
//
// Either end may go: then the IDE hears "port_closed". Nothing here waits for a slow end: what it
// has not taken is kept, and no more is read from the other end.
//
// Source: "Pluggable monitor specification" of arduino-cli.
#pragma once

#include <array>
#include <string>

#include "posix/unique_fd.h"
#include "qduino/ide/ide_tool.h"
#include "qduino/upload/serial_way.h"

namespace qduino::apps {

class IdeMonitor : public IdeTool {
  public:
    ~IdeMonitor() override { close(); }

    [[nodiscard]] std::vector<pollfd> waits() const override;
    [[nodiscard]] std::string serve(std::span<const pollfd> seen) override;

  private:
    /// One of the two ends.
    struct End {
        int fd = -1;
        std::string waiting;  ///< for it to take
        const char* farewell = "";
    };

    std::string carry_out(const Words& words) override;
    std::string open(const std::string& client, const std::string& port);
    Result<void> connect(const std::string& client, const std::string& port);
    void close();
    [[nodiscard]] bool is_open() const { return client_.valid(); }
    static bool serve(End& end, End& other, short events);

    posix::UniqueFd client_;  // the IDE's
    SerialWay way_;
    std::array<End, 2> ends_;  // the IDE, the sketch
};

}  // namespace qduino::apps
