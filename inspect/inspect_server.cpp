#include "inspect/inspect_server.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "posix/local_socket.h"
#include "posix/small_file.h"
#include "posix/system_error.h"

namespace qduino::apps {
namespace {

bool somebody_serves(const sockaddr_un& address) {
    const posix::UniqueFd probe{::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)};
    return ::connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
}

}  // namespace

// ---- the answering side ----------------------------------------------------------------------

Result<InspectServer> InspectServer::listen(const std::string& path, Answer answer) {
    QDUINO_TRY_ASSIGN(const sockaddr_un address, posix::local_address(path));
    if (somebody_serves(address))
        return make_error(ErrorCode::already_exists, "inspect socket: another machine serves this path");
    struct stat existing {};
    if (::lstat(path.c_str(), &existing) == 0) {
        if (!S_ISSOCK(existing.st_mode))
            return make_error(ErrorCode::already_exists, "inspect socket: something else has this path");
        ::unlink(path.c_str());
    }
    posix::UniqueFd listener{::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)};
    const int fd = listener.get();
    InspectServer server(path, std::move(listener), std::move(answer));
    if (::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
        return posix::system_error("make the inspect socket", path);
    // Mode before owner, and both before listen(): nobody else can connect in between.
    ::chmod(path.c_str(), 0600);
    posix::give_to_owner_of_folder(std::filesystem::absolute(path));
    if (::listen(fd, 8) != 0) return posix::system_error("serve the inspect socket", path);
    return server;
}

InspectServer::InspectServer(std::string path, posix::UniqueFd listener, Answer answer)
    : path_(std::move(path)), listener_(std::move(listener)), answer_(std::move(answer)) {}

InspectServer::~InspectServer() {
    if (listener_.valid()) ::unlink(path_.c_str());
}

std::size_t InspectServer::poll() {
    accept_new();
    std::size_t answered = 0;
    std::erase_if(clients_, [&](Client& client) { return !serve(client, answered); });
    return answered;
}

void InspectServer::accept_new() {
    posix::UniqueFd fd{::accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)};
    if (fd.valid() && clients_.size() < kClients) clients_.push_back({std::move(fd), {}, {}});
}

bool InspectServer::serve(Client& client, std::size_t& answered) {
    if (!send_some(client)) return false;
    if (client.unsent.size() > kUnsentBytes) return false;
    char bytes[4096];
    const ssize_t count = ::recv(client.fd.get(), bytes, sizeof bytes, 0);
    if (count == 0) return false;
    if (count < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
    client.received.append(bytes, static_cast<std::size_t>(count));
    std::size_t begin = 0;
    for (std::size_t end; (end = client.received.find('\n', begin)) != std::string::npos; begin = end + 1) {
        client.unsent += answer_(std::string_view{client.received}.substr(begin, end - begin));
        client.unsent += '\n';
        ++answered;
    }
    client.received.erase(0, begin);
    return client.received.size() <= kLineBytes && send_some(client);
}

bool InspectServer::send_some(Client& client) {
    while (!client.unsent.empty()) {
        const ssize_t count =
            ::send(client.fd.get(), client.unsent.data(), client.unsent.size(), MSG_NOSIGNAL);
        if (count < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
        client.unsent.erase(0, static_cast<std::size_t>(count));
    }
    return true;
}

// ---- the asking side -------------------------------------------------------------------------

namespace {

using SteadyTime = std::chrono::steady_clock::time_point;

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
            return make_error(ErrorCode::timed_out, "inspector: it does not take the request");
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
        if (!connection.wait(POLLIN, until))
            return make_error(ErrorCode::timed_out, "inspector: no answer in time");
        const ssize_t count = ::recv(connection.fd(), bytes, sizeof bytes, MSG_DONTWAIT);
        if (count == 0) return make_error(ErrorCode::unavailable, "inspector: it closed the connection");
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
    QDUINO_TRY_ASSIGN(const sockaddr_un address, posix::local_address(path_));
    const Connection connection;
    if (connection.fd() < 0) return system_failure("make a socket for");
    if (::connect(connection.fd(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
        return system_failure("reach");
    const std::string line = text<std::string>(request, '\n');
    QDUINO_TRY(send_all(connection, line, until));
    return receive_line(connection, until);
}

Result<std::string> InspectClient::job_begin(std::string_view job, std::string_view path,
                                             Nanoseconds timeout) const {
    const std::string quoted =
        nlohmann::json(path).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    return ask(text<std::string>(R"({"op":"job_begin","job":)", job, R"(,"path":)", quoted, '}'), timeout);
}

Result<std::string> InspectClient::job_typed(std::string_view job, std::uint32_t number,
                                             std::uint64_t behind_line, double left_mm, std::string_view line,
                                             Nanoseconds timeout) const {
    const std::string quoted =
        nlohmann::json(line).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    return ask(text<std::string>(R"({"op":"job_typed","job":)", job, R"(,"number":)", number,
                                 R"(,"behind_line":)", behind_line, R"(,"left_mm":)",
                                 nlohmann::json(left_mm).dump(), R"(,"line":)", quoted, '}'),
               timeout);
}

Result<std::string> InspectClient::job_end(std::string_view job, std::uint32_t excursions,
                                           Nanoseconds timeout) const {
    return ask(text<std::string>(R"({"op":"job_end","job":)", job, R"(,"excursions":)", excursions, '}'),
               timeout);
}

}  // namespace qduino::apps
