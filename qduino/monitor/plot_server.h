// Serves the plotter's page to a browser on this computer, and the lines of a sketch to the page.
//
//   /?key=K            the page
//   /series.js?key=K   how a line becomes points
//   /lines?key=K       server-sent events: each line of Serial as a JSON text
//
// It listens on the loopback address alone. Other users of the computer, and pages from elsewhere,
// do not know the key, which is new at each start. It has no thread: its caller waits for it with
// poll(2).
#pragma once

#include <poll.h>

#include <list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::apps {

class PlotServer {
  public:
    static constexpr std::size_t kRequestMax = 8 * 1024;
    static constexpr std::size_t kClientsMax = 16;
    static constexpr std::size_t kWaitingMax = 1024 * 1024;  ///< for one page; then it is let go
    static constexpr std::size_t kLinesKept = 500;           ///< for a page that is opened later

    /// `port` 0: any free one. Error: it is in use.
    [[nodiscard]] static Result<PlotServer> listen(int port);

    /// What to open in a browser.
    [[nodiscard]] const std::string& address() const { return address_; }
    /// Bytes of Serial; each line is sent on when it has ended.
    void take(std::string_view bytes);

    [[nodiscard]] std::vector<pollfd> waits() const;
    /// Takes the same entries back from poll(2).
    void serve(std::span<const pollfd> seen);

    /// The whole answer to a request without its body, or nothing while its end has not come.
    /// `streams` becomes true when lines follow. For tests as well.
    [[nodiscard]] std::string answer_to(std::string_view request, bool& streams) const;

  private:
    struct Client {
        posix::UniqueFd fd;
        std::string request;
        std::string waiting;
        bool answered = false;
        bool streams = false;
    };
    explicit PlotServer(posix::UniqueFd listener) : listener_(std::move(listener)) {}
    void accept_one();
    void read_request(Client& client);
    bool serve(Client& client, short events);

    posix::UniqueFd listener_;
    std::string key_, address_;
    std::string line_;                // begun
    std::vector<std::string> lines_;  // as events, the oldest first
    std::list<Client> clients_;
};

/// A line as an event of the stream: bytes that are no UTF-8 are replaced.
[[nodiscard]] std::string event_of(const std::string& line);

}  // namespace qduino::apps
