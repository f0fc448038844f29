// The network, over the sockets of the host, or of the board where there is no system below it
// (docs/metal.md): TCP clients and servers, UDP. Ethernet.h and WiFi.h give them those libraries'
// names.
//
// The host brings the network up, not the sketch. Calls that may wait (connecting, resolving a
// name, sending to a full socket) wait in the kernel: use them in setup() or in a loop without a
// hard deadline. In the simulator they reach the real network, and each byte takes the virtual time
// that the board file names: none by default.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "arduino/libraries/network/Client.h"
#include "arduino/libraries/network/Server.h"
#include "arduino/libraries/network/Udp.h"

namespace qduino::arduino {
class Socket;
}

/// One TCP connection; copies share it.
class NetClient : public Client {
  public:
    NetClient() = default;
    explicit NetClient(std::shared_ptr<qduino::arduino::Socket> socket) : socket_(std::move(socket)) {}

    int connect(IPAddress address, std::uint16_t port) override;
    int connect(const char* host, std::uint16_t port) override;
    void setConnectionTimeout(std::uint16_t timeout_ms) { connect_timeout_ms_ = timeout_ms; }

    std::size_t write(std::uint8_t value) override { return write(&value, 1); }
    /// Sends all of it. Returns less if the other side closed, or stopped reading for a second.
    std::size_t write(const std::uint8_t* buffer, std::size_t size) override;
    using Print::write;
    int available() override;
    int read() override;
    int read(std::uint8_t* buffer, std::size_t size) override;
    int peek() override;
    /// Closes the connection, for its copies as well.
    void stop() override;
    std::uint8_t connected() override;
    operator bool() override { return socket_ != nullptr; }
    bool operator==(const NetClient& other) const { return socket_ == other.socket_; }
    /// A state of TCP as the WiFi library numbers them: 4, established, or 0, closed.
    std::uint8_t status() { return connected() ? 4 : 0; }

    [[nodiscard]] IPAddress remoteIP() const;
    [[nodiscard]] std::uint16_t remotePort() const;
    [[nodiscard]] std::uint16_t localPort() const;

  private:
    std::shared_ptr<qduino::arduino::Socket> socket_;
    std::uint16_t connect_timeout_ms_ = 5000;
};

/// A TCP port of this computer. At most 16 connections at once; further ones wait in the kernel.
class NetServer : public Server {
  public:
    /// Port 0: one that is free; port() has it after begin().
    explicit NetServer(std::uint16_t port) : port_(port) {}
    /// Listens. An error is reported.
    void begin() override;
    /// The next connection that has sent something; false-like when none has.
    NetClient available();
    /// The next new connection, handed over: the server then forgets it.
    NetClient accept();
    /// Every connection gets it.
    std::size_t write(std::uint8_t value) override { return write(&value, 1); }
    std::size_t write(const std::uint8_t* buffer, std::size_t size) override;
    using Print::write;
    operator bool() const { return listener_ != nullptr; }
    /// 1, it listens, or 0.
    [[nodiscard]] std::uint8_t status() const { return listener_ ? 1 : 0; }
    [[nodiscard]] std::uint16_t port() const;

  private:
    void take_new();

    std::uint16_t port_;
    std::shared_ptr<qduino::arduino::Socket> listener_;
    std::vector<NetClient> clients_;
};

// A buffer that holds what most sketches send (the Ethernet library's number).
#define UDP_TX_PACKET_MAX_SIZE 24

class NetUDP : public UDP {
  public:
    static constexpr std::size_t kPacketMax = 1500;

    std::uint8_t begin(std::uint16_t port) override;
    std::uint8_t beginMulticast(IPAddress group, std::uint16_t port) override;
    void stop() override;
    int beginPacket(IPAddress address, std::uint16_t port) override;
    int beginPacket(const char* host, std::uint16_t port) override;
    int endPacket() override;
    std::size_t write(std::uint8_t value) override { return write(&value, 1); }
    std::size_t write(const std::uint8_t* buffer, std::size_t size) override;
    using Print::write;
    int parsePacket() override;
    int available() override { return static_cast<int>(in_size_ - in_read_); }
    int read() override { return in_read_ < in_size_ ? in_[in_read_++] : -1; }
    int read(unsigned char* buffer, std::size_t size) override;
    int read(char* buffer, std::size_t size) override {
        return read(reinterpret_cast<unsigned char*>(buffer), size);
    }
    int peek() override { return in_read_ < in_size_ ? in_[in_read_] : -1; }
    /// Drops what is left of the packet that is being read.
    void flush() override { in_read_ = in_size_; }
    IPAddress remoteIP() override { return remote_address_; }
    std::uint16_t remotePort() override { return remote_port_; }
    [[nodiscard]] std::uint16_t localPort() const;

  private:
    std::shared_ptr<qduino::arduino::Socket> socket_;
    IPAddress remote_address_;
    std::uint16_t remote_port_ = 0;
    IPAddress to_address_;
    std::uint16_t to_port_ = 0;
    std::array<std::uint8_t, kPacketMax> in_{};
    std::size_t in_size_ = 0;
    std::size_t in_read_ = 0;
    std::array<std::uint8_t, kPacketMax> out_{};
    std::size_t out_size_ = 0;
};

/// The first IPv4 address of this computer that is not the loopback; 0.0.0.0 when there is none. Of
/// that interface are the others: each is zero when it has none.
IPAddress networkLocalIP();
IPAddress networkSubnetMask();
IPAddress networkGatewayIP();
IPAddress networkNameServerIP();
/// Fills 6 bytes.
void networkHardwareAddress(std::uint8_t* address);
/// The radio's signal in dBm; 0: no radio.
std::int32_t networkSignal();
/// 1 and the address of `host`; 0 when nobody knows it. Waits for the resolver.
int networkHostByName(const char* host, IPAddress& address);
