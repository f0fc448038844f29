// A tool of a board's, which the Arduino IDE 2 and arduino-cli start: they write commands, one a
// line, and it answers with JSON.
//
//   IDE ── HELLO 1 "arduino-cli 1.2.3" ──► tool ── {"eventType": "hello", …} ──► IDE
//       ── LIST, OPEN, …               ──►      ── an answer to each, and events
//
// Source: "Pluggable discovery specification" and "Pluggable monitor specification" of arduino-cli,
// protocol version 1. What both have is here; ide_discovery.h and ide_monitor.h have the rest.
#pragma once

#include <poll.h>

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "qduino/common/words.h"

namespace qduino::apps {

/// The protocol of the ports of this board, as platform.txt names it.
inline constexpr const char* kIdeProtocol = "qduino";
/// The port of this computer. No host has such a name.
inline constexpr const char* kThisComputer = "this_computer";

/// The words of a command, split at blanks. "…" is one word, without its quotes; a quote that does
/// not end goes to the end of the line.
[[nodiscard]] Words words_of_command(std::string_view line);

/// One message, with a line end. Bytes that are no UTF-8 are replaced.
[[nodiscard]] std::string tool_message(const nlohmann::json& message);
[[nodiscard]] std::string tool_answer(std::string_view event);
[[nodiscard]] std::string tool_error(std::string_view event, std::string_view reason);

class IdeTool {
  public:
    /// Whether HELLO comes first: the IDE 1.8 has none.
    enum class Greeting { first, none };
    explicit IdeTool(Greeting greeting = Greeting::first) : greeted_(greeting == Greeting::none) {}
    virtual ~IdeTool() = default;
    IdeTool(const IdeTool&) = delete;
    IdeTool& operator=(const IdeTool&) = delete;

    /// What is written when a line has come, without its end.
    [[nodiscard]] std::string answer_to(std::string_view line);
    /// QUIT has come.
    [[nodiscard]] bool quits() const { return quits_; }

    /// What else to wait for; serve() takes the same entries back from poll(2), and returns what is
    /// written then.
    [[nodiscard]] virtual std::vector<pollfd> waits() const { return {}; }
    [[nodiscard]] virtual std::string serve(std::span<const pollfd> /*seen*/) { return {}; }

  protected:
    /// The answer to a command but HELLO and QUIT; the first word is its name. Empty: there is no
    /// such command, or its words are wrong.
    [[nodiscard]] virtual std::string carry_out(const Words& words) = 0;
    /// As QUIT does.
    void quit() { quits_ = true; }

  private:
    bool greeted_;
    bool quits_ = false;
};

/// The tool's life: commands on stdin, answers on stdout, until QUIT or the end of stdin. Returns
/// 0. Error: stdout has gone.
[[nodiscard]] Result<int> run_ide_tool(IdeTool& tool);

}  // namespace qduino::apps
