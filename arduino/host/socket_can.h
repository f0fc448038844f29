// A CAN bus of the host: frames through a raw CAN socket (Linux, Documentation/networking/can.rst).
//
//   write() ── struct can_frame ──► socket ──► can0
//   read()  ◄── ring of 32 ◄──────── socket       error and remote frames are left out
#pragma once

#include <string>

#include "arduino/libraries/CAN/HardwareCAN.h"
#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::arduino::host {

/// A socket on the CAN interface of this name. Error: no such interface, or it is down.
Result<posix::UniqueFd> open_can(const std::string& interface);

class SocketCan final : public HardwareCAN {
  public:
    SocketCan() = default;
    /// On a socket that carries `struct can_frame`s, one in each packet.
    explicit SocketCan(posix::UniqueFd socket) : socket_(std::move(socket)) {}

    /// Opens the interface that QDUINO_CAN names. The bit rate is the interface's own.
    bool begin(CanBitRate bit_rate) override;
    void end() override { socket_.reset(); }
    /// CAN_ERROR_GENERIC: the interface has no room, or is down.
    int write(const CanMsg& msg) override;
    std::size_t available() override;
    CanMsg read() override;

  private:
    posix::UniqueFd socket_;
    CanMsgRingbuffer received_;
};

}  // namespace qduino::arduino::host
