// Serial of one sketch, for several who read and write it.
//
//   sketch ──► backlog (the last 64 KiB) ──► each client; a newcomer gets the backlog first
//   clients ─► input ──► sketch
//
// The sketch never waits for a client. A client that reads too slowly loses its oldest bytes, and
// one that writes more than the sketch reads waits.
#pragma once

#include <poll.h>

#include <list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "posix/unique_fd.h"

namespace qduino::apps {

class SerialHub {
  public:
    static constexpr std::size_t kBacklogMax = 64 * 1024;
    static constexpr std::size_t kWaitingMax = 256 * 1024;  ///< for one client
    static constexpr std::size_t kInputMax = 64 * 1024;

    /// A client more; its descriptor does not block.
    void add(posix::UniqueFd client);
    /// The sketch has written `bytes`.
    void take_output(std::string_view bytes);
    /// What clients wrote for the sketch; forget() says how much of it is with the sketch.
    [[nodiscard]] std::string_view input() const { return input_; }
    void forget_input(std::size_t count) { input_.erase(0, count); }

    /// What to wait for, one entry a client; serve() takes the same, in the same order.
    [[nodiscard]] std::vector<pollfd> waits() const;
    /// Reads and writes what poll(2) says is possible; clients that have gone are forgotten.
    void serve(std::span<const pollfd> seen);
    /// True while something waits to be read by a client.
    [[nodiscard]] bool has_output() const;

  private:
    struct Client {
        posix::UniqueFd fd;
        std::string waiting;  ///< for it to read
    };
    bool serve(Client& client, short events);

    std::list<Client> clients_;
    std::string backlog_;
    std::string input_;
};

}  // namespace qduino::apps
