// Sockets of the host's system.
#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

#include "arduino/libraries/network/socket.h"
#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::arduino {

namespace {

constexpr int kSendWaitMs = 1000;
constexpr int kBacklog = 16;

sockaddr_in system_address(Endpoint endpoint) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = endpoint.address;
    address.sin_port = htons(endpoint.port);
    return address;
}

Endpoint endpoint_of(const sockaddr_in& address) {
    return {address.sin_addr.s_addr, ntohs(address.sin_port)};
}

const sockaddr* generic(const sockaddr_in& address) { return reinterpret_cast<const sockaddr*>(&address); }
sockaddr* generic(sockaddr_in& address) { return reinterpret_cast<sockaddr*>(&address); }

template <typename Name>
Endpoint end_of(int descriptor, Name name) {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    return name(descriptor, generic(address), &size) == 0 ? endpoint_of(address) : Endpoint{};
}

Error network_error(const char* what, std::uint16_t port) {
    return posix::system_error(what, text("port ", port));
}

bool wait_for(int descriptor, short events, int timeout_ms) {
    pollfd look{descriptor, events, 0};
    return poll(&look, 1, timeout_ms) == 1;
}

class HostSocket final : public Socket {
  public:
    explicit HostSocket(posix::UniqueFd descriptor) : descriptor_(std::move(descriptor)) {}

    void close() override { descriptor_ = posix::UniqueFd{}; }
    std::shared_ptr<Socket> accept() override;
    std::size_t send(std::span<const std::uint8_t> bytes) override;
    bool send_to(Endpoint to, std::span<const std::uint8_t> bytes) override;
    int receive(std::span<std::uint8_t> bytes, bool peek) override;
    std::optional<std::size_t> receive_from(std::span<std::uint8_t> bytes, Endpoint& from) override;
    [[nodiscard]] int available() override;
    [[nodiscard]] Endpoint local() const override { return end_of(descriptor_.get(), &getsockname); }
    [[nodiscard]] Endpoint remote() const override { return end_of(descriptor_.get(), &getpeername); }

  private:
    posix::UniqueFd descriptor_;
};

std::shared_ptr<Socket> make_socket(int type, int& descriptor) {
    posix::UniqueFd made{socket(AF_INET, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)};
    descriptor = made.get();
    return made.valid() ? std::make_shared<HostSocket>(std::move(made)) : nullptr;
}

std::shared_ptr<Socket> HostSocket::accept() {
    posix::UniqueFd accepted{accept4(descriptor_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)};
    return accepted.valid() ? std::make_shared<HostSocket>(std::move(accepted)) : nullptr;
}

std::size_t HostSocket::send(std::span<const std::uint8_t> bytes) {
    std::size_t sent = 0;
    while (sent < bytes.size()) {
        const ssize_t count =
            ::send(descriptor_.get(), bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
        if (count > 0) sent += static_cast<std::size_t>(count);
        if (count >= 0 || errno == EINTR) continue;
        if (errno != EAGAIN || !wait_for(descriptor_.get(), POLLOUT, kSendWaitMs)) break;
    }
    return sent;
}

bool HostSocket::send_to(Endpoint to, std::span<const std::uint8_t> bytes) {
    const sockaddr_in address = system_address(to);
    return sendto(descriptor_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL, generic(address),
                  sizeof address) >= 0;
}

int HostSocket::receive(std::span<std::uint8_t> bytes, bool peek) {
    const ssize_t count = recv(descriptor_.get(), bytes.data(), bytes.size(), peek ? MSG_PEEK : 0);
    if (count > 0) return static_cast<int>(count);
    return count < 0 && (errno == EAGAIN || errno == EINTR) ? 0 : -1;
}

std::optional<std::size_t> HostSocket::receive_from(std::span<std::uint8_t> bytes, Endpoint& from) {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    const ssize_t count = recvfrom(descriptor_.get(), bytes.data(), bytes.size(), 0, generic(address), &size);
    if (count < 0) return std::nullopt;
    from = endpoint_of(address);
    return static_cast<std::size_t>(count);
}

int HostSocket::available() {
    int count = 0;
    return ioctl(descriptor_.get(), FIONREAD, &count) == 0 ? count : 0;
}

}  // namespace

Result<std::shared_ptr<Socket>> connect_socket(Endpoint to, int timeout_ms) {
    int descriptor = -1;
    auto made = make_socket(SOCK_STREAM, descriptor);
    const sockaddr_in address = system_address(to);
    if (!made) return network_error("connect to", to.port);
    if (::connect(descriptor, generic(address), sizeof address) == 0) return made;
    if (errno != EINPROGRESS) return network_error("connect to", to.port);
    if (!wait_for(descriptor, POLLOUT, timeout_ms)) {
        errno = ETIMEDOUT;
        return network_error("connect to", to.port);
    }
    int failure = 0;
    socklen_t size = sizeof failure;
    getsockopt(descriptor, SOL_SOCKET, SO_ERROR, &failure, &size);
    if (failure == 0) return made;
    errno = failure;
    return network_error("connect to", to.port);
}

Result<std::shared_ptr<Socket>> listen_socket(std::uint16_t port) {
    int descriptor = -1;
    auto made = make_socket(SOCK_STREAM, descriptor);
    if (!made) return network_error("listen on", port);
    const int yes = 1;
    setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    const sockaddr_in address = system_address({htonl(INADDR_ANY), port});
    if (bind(descriptor, generic(address), sizeof address) != 0 || ::listen(descriptor, kBacklog) != 0) {
        return network_error("listen on", port);
    }
    return made;
}

Result<std::shared_ptr<Socket>> udp_socket(std::uint16_t port, std::optional<std::uint32_t> group) {
    int descriptor = -1;
    auto made = make_socket(SOCK_DGRAM, descriptor);
    if (!made) return network_error("take UDP", port);
    const int yes = 1;
    if (group) setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    const sockaddr_in address = system_address({htonl(INADDR_ANY), port});
    if (bind(descriptor, generic(address), sizeof address) != 0) return network_error("take UDP", port);
    if (!group) return made;
    ip_mreq membership{};
    membership.imr_multiaddr.s_addr = *group;
    membership.imr_interface.s_addr = htonl(INADDR_ANY);
    if (setsockopt(descriptor, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0) {
        return network_error("multicast on", port);
    }
    return made;
}

std::optional<std::uint32_t> resolve(const char* host) {
    addrinfo wanted{};
    wanted.ai_family = AF_INET;
    wanted.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    if (getaddrinfo(host, nullptr, &wanted, &found) != 0 || !found) return std::nullopt;
    sockaddr_in address{};
    std::memcpy(&address, found->ai_addr, sizeof address);
    freeaddrinfo(found);
    return address.sin_addr.s_addr;
}

}  // namespace qduino::arduino
