// What Network.h stands on: one end of a network connection. IPv4; never waits unless a comment
// here says so.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "base/result.h"

namespace qduino::arduino {

/// An IPv4 address, its bytes in network order, and a port in the host's.
struct Endpoint {
    std::uint32_t address = 0;
    std::uint16_t port = 0;
};

/// It closes with its last owner. Calls come from one loop at a time.
class Socket {
  public:
    virtual ~Socket() = default;
    /// Closes it for all owners: calls on it find nothing, and send nothing. What was sent arrives.
    virtual void close() = 0;

    /// The next connection, or null.
    virtual std::shared_ptr<Socket> accept() = 0;
    /// Waits up to a second for room; returns what was taken.
    virtual std::size_t send(std::span<const std::uint8_t> bytes) = 0;
    virtual bool send_to(Endpoint to, std::span<const std::uint8_t> bytes) = 0;
    /// Bytes read; 0 when none are there; -1 when the other side has closed.
    virtual int receive(std::span<std::uint8_t> bytes, bool peek) = 0;
    int receive(std::span<std::uint8_t> bytes) { return receive(bytes, false); }
    /// The next packet, cut to `bytes`; none when none is there.
    virtual std::optional<std::size_t> receive_from(std::span<std::uint8_t> bytes, Endpoint& from) = 0;
    [[nodiscard]] virtual int available() = 0;
    [[nodiscard]] virtual Endpoint local() const = 0;
    [[nodiscard]] virtual Endpoint remote() const = 0;
};

// A program is linked with those of its system: host/socket.cpp on Linux and in the simulator,
// arduino/metal/sockets.cpp without one.

/// Waits up to `timeout_ms`.
Result<std::shared_ptr<Socket>> connect_socket(Endpoint to, int timeout_ms);
/// Port 0: one that is free.
Result<std::shared_ptr<Socket>> listen_socket(std::uint16_t port);
/// `group`: also packets to this multicast address.
Result<std::shared_ptr<Socket>> udp_socket(std::uint16_t port, std::optional<std::uint32_t> group);
/// The address of a name, or of digits. Waits for the resolver.
std::optional<std::uint32_t> resolve(const char* host);

}  // namespace qduino::arduino
