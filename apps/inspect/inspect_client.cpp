#include "apps/inspect/inspect_client.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>

#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::apps {
namespace {

using SteadyTime = std::chrono::steady_clock::time_point;

Error failure(ErrorCode code, std::string_view what) {
    Error error{code, "inspector: "};
    error.message.append(what);
    return error;
}

/// The code for a machine that is not there is not_found, whether its socket is missing or nobody
/// listens.
Error system_failure(std::string_view what) {
    const int number = errno;
    Error error = posix::system_error(what, "the inspector", number);
    if (number == ECONNREFUSED) error.code = ErrorCode::not_found;
    if (error.code != ErrorCode::not_found && error.code != ErrorCode::not_permitted)
        error.code = ErrorCode::unavailable;
    return error;
}

class Connection {
  public:
    Connection() : fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {}
    [[nodiscard]] int fd() const { return fd_.get(); }

    /// False when nothing happened until `until`.
    [[nodiscard]] bool wait(short events, SteadyTime until) const {
        using std::chrono::milliseconds;
        const auto left = std::chrono::ceil<milliseconds>(until - std::chrono::steady_clock::now());
        pollfd waiting{fd(), events, 0};
        return left.count() > 0 && ::poll(&waiting, 1, static_cast<int>(left.count())) > 0;
    }

  private:
    posix::UniqueFd fd_;
};

Result<void> send_all(const Connection& connection, std::string_view bytes, SteadyTime until) {
    while (!bytes.empty()) {
        if (!connection.wait(POLLOUT, until))
            return failure(ErrorCode::timed_out, "it does not take the request");
        const ssize_t count =
            ::send(connection.fd(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
        if (count < 0 && errno != EAGAIN && errno != EINTR) return system_failure("send to");
        if (count > 0) bytes.remove_prefix(static_cast<std::size_t>(count));
    }
    return {};
}

Result<std::string> receive_line(const Connection& connection, SteadyTime until) {
    std::string line;
    char bytes[16384];
    for (;;) {
        if (!connection.wait(POLLIN, until)) return failure(ErrorCode::timed_out, "no answer in time");
        const ssize_t count = ::recv(connection.fd(), bytes, sizeof bytes, MSG_DONTWAIT);
        if (count == 0) return failure(ErrorCode::unavailable, "it closed the connection");
        if (count < 0 && errno != EAGAIN && errno != EINTR) return system_failure("hear from");
        if (count > 0) line.append(bytes, static_cast<std::size_t>(count));
        if (!line.empty() && line.back() == '\n') {
            line.pop_back();
            return line;
        }
    }
}

}  // namespace

Result<std::string> InspectClient::ask(std::string_view request, Nanoseconds timeout) const {
    const SteadyTime until = std::chrono::steady_clock::now() + timeout;
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path_.empty() || path_.size() >= sizeof address.sun_path)
        return failure(ErrorCode::invalid_argument, "the socket's path must have 1 to 107 bytes");
    std::memcpy(address.sun_path, path_.data(), path_.size());
    const Connection connection;
    if (connection.fd() < 0) return system_failure("make a socket for");
    if (::connect(connection.fd(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
        return system_failure("reach");
    std::string line(request);
    line += '\n';
    if (const Result<void> sent = send_all(connection, line, until); !sent) return sent.error();
    return receive_line(connection, until);
}

Result<std::string> InspectClient::job_begin(std::string_view job, std::string_view path,
                                             Nanoseconds timeout) const {
    const std::string quoted =
        nlohmann::json(path).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    return ask(R"({"op":"job_begin","job":)" + std::string(job) + R"(,"path":)" + quoted + "}", timeout);
}

Result<std::string> InspectClient::job_end(std::string_view job, std::uint32_t excursions,
                                           Nanoseconds timeout) const {
    return ask(R"({"op":"job_end","job":)" + std::string(job) + R"(,"excursions":)" +
                   std::to_string(excursions) + "}",
               timeout);
}

}  // namespace qduino::apps
