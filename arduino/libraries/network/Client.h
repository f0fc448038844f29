// Client: a connection that can be opened, as a Stream. Libraries take one; NetClient (Network.h)
// is one over TCP.
#pragma once

#include "arduino/Stream.h"
#include "arduino/libraries/network/IPAddress.h"

class Client : public Stream {
  public:
    /// 1 when connected.
    virtual int connect(IPAddress address, std::uint16_t port) = 0;
    virtual int connect(const char* host, std::uint16_t port) = 0;
    using Print::write;
    using Stream::read;
    /// Reads up to `size` bytes that have come. 0: none have; -1: none will.
    virtual int read(std::uint8_t* buffer, std::size_t size) = 0;
    virtual void stop() = 0;
    /// Nonzero while connected, or while there is still something to read.
    virtual std::uint8_t connected() = 0;
    virtual operator bool() = 0;
};

namespace arduino {
using ::Client;
}  // namespace arduino
