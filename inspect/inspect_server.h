// The inspector's socket: newline-delimited JSON over a unix-domain stream socket, served from a
// loop that has other work.
//
// poll() never blocks and does one bounded piece of work: accept, read, answer, write. A client
// that sends a line longer than kLineBytes, or does not take its answers, is dropped; the others do
// not notice.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "posix/unique_fd.h"

namespace qduino::apps {

class InspectServer {
  public:
    static constexpr std::size_t kClients = 16;
    static constexpr std::size_t kLineBytes = 16 * 1024;
    static constexpr std::size_t kUnsentBytes = 16 * 1024 * 1024;

    using Answer = std::function<std::string(std::string_view)>;

    /// Listens at `path`, and replaces a socket that no process serves any more. The socket has
    /// mode 0600 and belongs to the owner of its folder: so the user whose folder it is can ask a
    /// machine that root runs. Errors: already_exists when another process serves this path;
    /// invalid_argument (path too long); not_permitted, unavailable.
    static Result<InspectServer> listen(const std::string& path, Answer answer);

    InspectServer(InspectServer&& other) = default;
    InspectServer& operator=(InspectServer&&) = delete;
    ~InspectServer();

    /// Serves the clients that ask now. Returns the number of requests answered.
    std::size_t poll();

  private:
    struct Client {
        posix::UniqueFd fd;
        std::string received;
        std::string unsent;
    };
    InspectServer(std::string path, posix::UniqueFd listener, Answer answer);
    void accept_new();
    /// False when the client is gone or must go.
    [[nodiscard]] bool serve(Client& client, std::size_t& answered);
    [[nodiscard]] static bool send_some(Client& client);

    std::string path_;
    posix::UniqueFd listener_;
    Answer answer_;
    std::vector<Client> clients_;
};

/// The asking side (inspect_service.h lists the questions).
class InspectClient {
  public:
    /// Does not connect yet: the machine may come and go.
    explicit InspectClient(std::string path) : path_(std::move(path)) {}

    /// Sends one request, returns the line that answers it, without its end. Connects for each call
    /// and blocks up to `timeout`: not for real-time loops, nor for a thread that serves others.
    /// Errors: not_found (no machine serves the path), timed_out, unavailable, not_permitted.
    [[nodiscard]] Result<std::string> ask(std::string_view request, Nanoseconds timeout) const;

    /// The questions about a job. `job` is the id as JSON (a number, or a string with its quotes).
    [[nodiscard]] Result<std::string> job_begin(std::string_view job, std::string_view path,
                                                Nanoseconds timeout) const;
    [[nodiscard]] Result<std::string> job_typed(std::string_view job, std::uint32_t number,
                                                std::uint64_t behind_line, double left_mm,
                                                std::string_view line, Nanoseconds timeout) const;
    [[nodiscard]] Result<std::string> job_end(std::string_view job, std::uint32_t excursions,
                                              Nanoseconds timeout) const;

  private:
    std::string path_;
};

}  // namespace qduino::apps
