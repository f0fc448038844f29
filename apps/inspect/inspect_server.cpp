#include "apps/inspect/inspect_server.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

namespace qduino::apps {
namespace {

Error system_error(std::string_view what, const std::string& path) {
    const int number = errno;
    const ErrorCode code =
        number == EACCES || number == EPERM ? ErrorCode::not_permitted : ErrorCode::unavailable;
    Error error{code, what};
    error.message.append(" ").append(path).append(": ").append(std::strerror(number));
    return error;
}

bool somebody_serves(const sockaddr_un& address) {
    const int probe = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (probe < 0) return false;
    const bool served = ::connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    ::close(probe);
    return served;
}

// Mode before owner, and both before listen(): nobody else can connect in between.
void give_to_owner_of_folder(const std::string& path) {
    ::chmod(path.c_str(), 0600);
    struct stat folder {};
    const std::string parent = std::filesystem::absolute(path).parent_path().string();
    if (::stat(parent.c_str(), &folder) != 0) return;
    // Refused to an ordinary user, who owns the socket already.
    [[maybe_unused]] const int ignored = ::chown(path.c_str(), folder.st_uid, folder.st_gid);
}

}  // namespace

Result<InspectServer> InspectServer::listen(const std::string& path, Answer answer) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.empty() || path.size() >= sizeof address.sun_path)
        return make_error(ErrorCode::invalid_argument, "inspect socket: the path must have 1 to 107 bytes");
    std::memcpy(address.sun_path, path.data(), path.size());
    if (somebody_serves(address))
        return make_error(ErrorCode::already_exists, "inspect socket: another machine serves this path");
    struct stat existing {};
    if (::lstat(path.c_str(), &existing) == 0) {
        if (!S_ISSOCK(existing.st_mode))
            return make_error(ErrorCode::already_exists, "inspect socket: something else has this path");
        ::unlink(path.c_str());
    }
    const int listener = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (listener < 0) return system_error("inspect socket", path);
    InspectServer server(path, listener, std::move(answer));
    if (::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
        return system_error("inspect socket", path);
    give_to_owner_of_folder(path);
    if (::listen(listener, 8) != 0) return system_error("inspect socket", path);
    return server;
}

InspectServer::InspectServer(std::string path, int listener, Answer answer)
    : path_(std::move(path)), listener_(listener), answer_(std::move(answer)) {}

InspectServer::InspectServer(InspectServer&& other) noexcept
    : path_(std::move(other.path_)),
      listener_(std::exchange(other.listener_, -1)),
      answer_(std::move(other.answer_)),
      clients_(std::exchange(other.clients_, {})) {}

InspectServer::~InspectServer() {
    for (const Client& client : clients_) ::close(client.fd);
    if (listener_ < 0) return;
    ::close(listener_);
    ::unlink(path_.c_str());
}

std::size_t InspectServer::poll() {
    accept_new();
    std::size_t answered = 0;
    std::erase_if(clients_, [&](Client& client) {
        if (serve(client, answered)) return false;
        ::close(client.fd);
        return true;
    });
    return answered;
}

void InspectServer::accept_new() {
    const int fd = ::accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0) return;
    if (clients_.size() == kClients) {
        ::close(fd);
        return;
    }
    clients_.push_back({fd, {}, {}});
}

bool InspectServer::serve(Client& client, std::size_t& answered) {
    if (!send_some(client)) return false;
    if (client.unsent.size() > kUnsentBytes) return false;
    char bytes[4096];
    const ssize_t count = ::recv(client.fd, bytes, sizeof bytes, 0);
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
        const ssize_t count = ::send(client.fd, client.unsent.data(), client.unsent.size(), MSG_NOSIGNAL);
        if (count < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
        client.unsent.erase(0, static_cast<std::size_t>(count));
    }
    return true;
}

}  // namespace qduino::apps
