#include "qduino/ide/ide_discovery.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "qduino/ide/ide_platform.h"

namespace qduino::apps {
namespace {

nlohmann::json json_of(const IdePort& port) {
    return {{"address", port.address},
            {"label", port.label},
            {"protocol", port.protocol},
            {"protocolLabel", "QduinoMC"},
            {"properties", {{"board", port.board}}}};
}

}  // namespace

std::vector<IdePort> ports_of(const Words& hosts) {
    std::vector<IdePort> ports{{kThisComputer, "this computer", kBoardHere, kIdeProtocol}};
    for (const std::string& host : hosts) ports.push_back({host, host, board_id_of(host), kIdeProtocol});
    return ports;
}

std::string IdeDiscovery::carry_out(const Words& words) {
    if (words.size() != 1) return "";
    if (words[0] == "START") return start();
    if (words[0] == "START_SYNC") return start_sync();
    if (words[0] == "LIST") return list();
    if (words[0] == "STOP") return stop();
    return "";
}

std::string IdeDiscovery::start() {
    if (state_ != State::idle) return tool_error("start", "It was started before");
    state_ = State::started;
    return tool_answer("start");
}

// The text of the specification wants a START before it, its diagram and its clients none.
std::string IdeDiscovery::start_sync() {
    if (state_ == State::syncing) return tool_error("start_sync", "It was started before");
    state_ = State::syncing;
    std::string said = tool_answer("start_sync");
    for (const nlohmann::json& port : ports()) said += tool_message({{"eventType", "add"}, {"port", port}});
    return said;
}

std::string IdeDiscovery::list() const {
    if (state_ != State::started) return tool_error("list", "START comes before, and no START_SYNC");
    return tool_message({{"eventType", "list"}, {"ports", ports()}});
}

std::string IdeDiscovery::stop() {
    if (std::exchange(state_, State::idle) == State::idle) return tool_error("stop", "It was not started");
    return tool_answer("stop");
}

nlohmann::json IdeDiscovery::ports() const {
    nlohmann::json ports = nlohmann::json::array();
    for (const IdePort& port : ports_) ports.push_back(json_of(port));
    return ports;
}

}  // namespace qduino::apps
