// The ports of this board, for the Arduino IDE 2 and arduino-cli: this computer, and those that
// `qduino ide install --to` named. Each is always there; nobody asks the network.
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

#include "apps/qduino/ide_tool.h"

namespace qduino::apps {

class IdeDiscovery : public IdeTool {
  public:
    /// `hosts` as ssh takes them.
    explicit IdeDiscovery(Words hosts) : hosts_(std::move(hosts)) {}

  private:
    enum class State { idle, started, syncing };

    std::string carry_out(const Words& words) override;
    std::string start();
    std::string start_sync();
    std::string stop();
    [[nodiscard]] std::string list() const;
    [[nodiscard]] nlohmann::json ports() const;

    Words hosts_;
    State state_ = State::idle;
};

}  // namespace qduino::apps
