// The ports of this board, for the Arduino IDE 2 and arduino-cli (for IDE 1.8: ide_serial.h):
// this computer, and those that `qduino ide install --to` named. Each is always there; nobody asks
// the network.
//
//            START         LIST
//   idle ────────► started ────► ports        START_SYNC ────► syncing: an "add" for each port
//    ▲ ◄──── STOP ────┘                                          │
//    └──────────────────────────── STOP ─────────────────────────┘
//
// Source: "Pluggable discovery specification" of arduino-cli. A port names its board by the
// property "board", which boards.txt has as `upload_port.board` (ide_platform.h).
#pragma once

#include <string>

#include "qduino/ide/ide_tool.h"

namespace qduino::apps {

struct IdePort {
    std::string address, label;
    std::string board;     ///< its board's id in boards.txt
    std::string protocol;  ///< which monitor it wants
};
/// This computer's, then one for each of `hosts`, as ssh takes them.
[[nodiscard]] std::vector<IdePort> ports_of(const Words& hosts);

class IdeDiscovery : public IdeTool {
  public:
    explicit IdeDiscovery(std::vector<IdePort> ports, Greeting greeting = Greeting::first)
        : IdeTool(greeting), ports_(std::move(ports)) {}

  private:
    enum class State { idle, started, syncing };

    std::string carry_out(const Words& words) override;
    std::string start();
    std::string start_sync();
    std::string stop();
    [[nodiscard]] std::string list() const;
    [[nodiscard]] nlohmann::json ports() const;

    std::vector<IdePort> ports_;
    State state_ = State::idle;
};

}  // namespace qduino::apps
