// UDP: packets. Libraries take one; NetUDP (Network.h) is one.
#pragma once

#include "arduino/Stream.h"
#include "arduino/libraries/network/IPAddress.h"

class UDP : public Stream {
  public:
    /// 1 when `port` could be taken.
    virtual std::uint8_t begin(std::uint16_t port) = 0;
    virtual std::uint8_t beginMulticast(IPAddress group, std::uint16_t port) = 0;
    virtual void stop() = 0;
    virtual int beginPacket(IPAddress address, std::uint16_t port) = 0;
    virtual int beginPacket(const char* host, std::uint16_t port) = 0;
    /// 1 when the packet was sent.
    virtual int endPacket() = 0;
    /// Drops what is left of the last packet and takes the next; its size, or 0.
    virtual int parsePacket() = 0;
    using Print::write;
    using Stream::read;
    virtual int read(unsigned char* buffer, std::size_t size) = 0;
    virtual int read(char* buffer, std::size_t size) = 0;
    virtual IPAddress remoteIP() = 0;
    virtual std::uint16_t remotePort() = 0;
};

namespace arduino {
using ::UDP;
}  // namespace arduino
