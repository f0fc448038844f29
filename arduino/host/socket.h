// A socket of the host that closes with its last owner. IPv4; never blocks unless a comment here
// says so.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::arduino::host {

/// An IPv4 address, its bytes in network order, and a port in the host's.
struct Endpoint {
    std::uint32_t address = 0;
    std::uint16_t port = 0;
};

class Socket {
  public:
    explicit Socket(posix::UniqueFd descriptor) : descriptor_(std::move(descriptor)) {}

    /// Waits up to `timeout_ms`.
    static Result<std::shared_ptr<Socket>> connect(Endpoint to, int timeout_ms);
    static Result<std::shared_ptr<Socket>> listen(std::uint16_t port);
    static Result<std::shared_ptr<Socket>> bind_udp(std::uint16_t port, std::optional<std::uint32_t> group);

    /// The next connection, or null.
    std::shared_ptr<Socket> accept();
    /// Waits up to a second for room; returns what was taken.
    std::size_t send(std::span<const std::uint8_t> bytes);
    bool send_to(Endpoint to, std::span<const std::uint8_t> bytes);
    /// Bytes read; 0 when none are there; -1 when the other side has closed.
    int receive(std::span<std::uint8_t> bytes, bool peek = false);
    /// The next packet, cut to `bytes`; none when none is there.
    std::optional<std::size_t> receive_from(std::span<std::uint8_t> bytes, Endpoint& from);
    [[nodiscard]] int available() const;
    [[nodiscard]] Endpoint local() const;
    [[nodiscard]] Endpoint remote() const;

  private:
    posix::UniqueFd descriptor_;
};

/// Waits for the resolver.
std::optional<std::uint32_t> resolve(const std::string& host);
/// The first address of this computer that is not the loopback.
std::optional<std::uint32_t> first_local_address();

}  // namespace qduino::arduino::host
