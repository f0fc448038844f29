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

#include "posix/owner.h"
#include "posix/system_error.h"

namespace qduino::apps {
namespace {

bool somebody_serves(const sockaddr_un& address) {
    const posix::UniqueFd probe{::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)};
    return ::connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
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

}  // namespace qduino::apps
