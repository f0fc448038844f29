// Tells the network by multicast DNS (RFC 6762) that NAME.local is this computer, and that a
// printer is served there (RFC 6763, _https._tcp).
//
// Avahi's own library answers: the same code as its daemon's, which probes for others of the name,
// follows addresses that come and go, and says goodbye. No daemon has to run, and one that runs is
// not disturbed: both hear the same multicasts.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "base/result.h"

namespace qduino::name {

enum class Event {
    announced,  ///< the name is ours; again after each change of the network
    taken,      ///< another computer has it
    failed,     ///< the library cannot go on
};

class Announcer {
  public:
    /// `on_event` is called from within run().
    Announcer(std::string name, std::uint16_t port, std::function<void(Event)> on_event);
    ~Announcer();
    Announcer(const Announcer&) = delete;
    Announcer& operator=(const Announcer&) = delete;

    /// Errors: unavailable (no network, or the port 5353 is another's alone).
    [[nodiscard]] Result<void> start();
    /// Serves until `stop` is readable, or stop() is called. Then says goodbye.
    void run(int stop);
    void stop();

  private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

}  // namespace qduino::name
