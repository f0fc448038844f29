// The port that a serial host opens: a pseudo-terminal of this computer, or a device (a USB gadget,
// a UART) with a wire behind it.
//
//   pty      host opens /dev/pts/N ◄── link with a name that stays ── state folder
//   device   /dev/ttyGS0, /dev/ttyAMA0@250000
//   relayed  another process has one of these (apps/port): a socket stands for it here
//
// Raw bytes both ways, eight bits, no flow control. Nothing blocks.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::apps {

class SerialPort {
  public:
    static constexpr std::uint32_t kBaud = 250'000;

    /// A new pseudo-terminal; `link` becomes a symbolic link to the host's end of it.
    [[nodiscard]] static Result<SerialPort> make_pty(const std::filesystem::path& link);
    /// `name`: a device, or `DEVICE@BAUD` (any number that the device can). Errors: the kernel's;
    /// invalid_argument.
    [[nodiscard]] static Result<SerialPort> open_device(std::string_view name);

    /// The port of another process, which connects to a socket at `path` while a host is there.
    /// `sees_host`: whether that one can tell (a pty can). Errors: the kernel's; invalid_argument.
    [[nodiscard]] static Result<SerialPort> relayed(const std::string& path, bool sees_host);

    /// The caller may poll(2) it.
    [[nodiscard]] int fd() const { return fd_.get(); }
    /// The host's end.
    [[nodiscard]] const std::string& name() const { return name_; }
    /// False for a device: nobody can tell whether a host is at the wire's other end.
    [[nodiscard]] bool sees_host() const { return sees_host_; }
    /// A host has opened the pty, or the other process has connected. For a device: true.
    [[nodiscard]] bool host_is_there();
    /// Bytes read; 0: none now. Error: the port has gone, or the host of a pty has.
    [[nodiscard]] Result<std::size_t> read(std::span<char> bytes) const;
    /// Bytes written; the rest did not fit now. What a port that has gone would get is lost.
    [[nodiscard]] std::size_t write(std::string_view bytes) const;

  private:
    SerialPort(posix::UniqueFd fd, std::string name, bool sees_host)
        : fd_(std::move(fd)), name_(std::move(name)), sees_host_(sees_host) {}

    posix::UniqueFd fd_;
    posix::UniqueFd listener_;  // relayed; fd_ is then a connection, or none
    std::string name_;
    bool sees_host_ = false;
};

/// The end of the process that has the port: connects to the socket of SerialPort::relayed().
/// Error: unavailable while nobody listens.
[[nodiscard]] Result<posix::UniqueFd> connect_relay(const std::string& path);

}  // namespace qduino::apps
