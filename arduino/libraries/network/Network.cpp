#include "arduino/libraries/network/Network.h"

#include <algorithm>

#include "arduino/core/diagnostics.h"
#include "arduino/core/host_question.h"
#include "arduino/libraries/network/interface.h"
#include "arduino/libraries/network/socket.h"
#include "board/board.h"

using qduino::Result;
using qduino::arduino::Endpoint;
using qduino::arduino::report_error;
using qduino::arduino::Socket;
namespace network = qduino::arduino;

namespace {

constexpr std::size_t kClientsMax = 16;

/// So many bytes went through the network card; an error, or nothing, did not.
template <typename Count>
Count moved(Count bytes) {
    if (bytes > 0) {
        qduino::board::current().device_work(qduino::board::DeviceClass::nic,
                                             static_cast<std::size_t>(bytes));
    }
    return bytes;
}

/// The sockets speak IPv4. An IPv6 address is reported: as a number it is 0.0.0.0, this computer.
bool can_reach(const char* call, int port, const IPAddress& address) {
    return address.type() == IPv4 || network::refuse(call, port, qduino::ErrorCode::invalid_argument,
                                                     "an IPv6 address: the sockets here speak IPv4");
}

constexpr auto kNic = qduino::board::DeviceClass::nic;
/// A refused connection, a name, or a look at the interfaces takes the host as long as so many
/// short system calls.
constexpr int kLongCalls = 50;
/// Until the resolver says that nobody knows a name; they make 0.1 s of virtual time. A loop that
/// tries again and again would otherwise ask it ten thousand times for each second.
constexpr int kUnknownName = 50'000;

void asked(int times = 1) { network::asked_in_vain(kNic, times); }

std::optional<std::uint32_t> resolved(const char* host_name) {
    const auto address = network::resolve(host_name);
    asked(address ? kLongCalls : kUnknownName);
    return address;
}

network::Interface interface_of_host() {
    asked(kLongCalls);
    return network::first_interface();
}

/// The socket; null, and reported, when it could not be made.
std::shared_ptr<Socket> or_reported(const char* call, int port, Result<std::shared_ptr<Socket>> made) {
    if (made.ok()) return std::move(*made);
    report_error(call, port, made.error());
    return nullptr;
}

}  // namespace

// ---- NetClient ----------------------------------------------------------------------------------

int NetClient::connect(IPAddress address, std::uint16_t port) {
    if (!can_reach("client.connect", port, address)) return 0;
    auto made = network::connect_socket({address, port}, connect_timeout_ms_);
    socket_ = made.ok() ? made.value() : nullptr;
    if (!socket_) asked(kLongCalls);
    return socket_ ? 1 : 0;
}

int NetClient::connect(const char* host_name, std::uint16_t port) {
    const auto address = resolved(host_name);
    return address ? connect(IPAddress(*address), port) : 0;
}

std::size_t NetClient::write(const std::uint8_t* buffer, std::size_t size) {
    asked();  // a loop that sends repeats it as well
    const std::size_t sent = socket_ ? moved(socket_->send({buffer, size})) : 0;
    if (sent < size) setWriteError();
    return sent;
}

void NetClient::stop() {
    if (socket_) socket_->close();
    socket_.reset();
}

int NetClient::available() { return network::found_on(kNic, socket_ ? socket_->available() : 0); }

int NetClient::read() {
    std::uint8_t value;
    return read(&value, 1) == 1 ? value : -1;
}
int NetClient::read(std::uint8_t* buffer, std::size_t size) {
    return network::found_on(kNic, socket_ ? moved(socket_->receive({buffer, size})) : -1);
}
int NetClient::peek() {
    std::uint8_t value;
    const int count = socket_ ? socket_->receive({&value, 1}, true) : -1;
    return network::found_on(kNic, count) == 1 ? value : -1;
}

std::uint8_t NetClient::connected() {
    std::uint8_t value;
    return network::found_on(kNic, socket_ ? socket_->receive({&value, 1}, true) : -1) >= 0 ? 1 : 0;
}

IPAddress NetClient::remoteIP() const { return socket_ ? IPAddress(socket_->remote().address) : IPAddress(); }
std::uint16_t NetClient::remotePort() const { return socket_ ? socket_->remote().port : 0; }
std::uint16_t NetClient::localPort() const { return socket_ ? socket_->local().port : 0; }

// ---- NetServer ----------------------------------------------------------------------------------

void NetServer::begin() { listener_ = or_reported("server.begin", port_, network::listen_socket(port_)); }

std::uint16_t NetServer::port() const { return listener_ ? listener_->local().port : port_; }

void NetServer::take_new() {
    std::erase_if(clients_, [](NetClient& client) { return !client.connected(); });
    while (listener_ && clients_.size() < kClientsMax) {
        auto socket = listener_->accept();
        if (!socket) return asked();
        clients_.emplace_back(std::move(socket));
    }
}

NetClient NetServer::available() {
    take_new();
    for (NetClient& client : clients_) {
        if (client.available() > 0) return client;
    }
    return NetClient();
}

NetClient NetServer::accept() {
    auto socket = listener_ ? listener_->accept() : nullptr;
    if (!socket) asked();
    return socket ? NetClient(std::move(socket)) : NetClient();
}

std::size_t NetServer::write(const std::uint8_t* buffer, std::size_t size) {
    take_new();
    std::size_t most = 0;
    for (NetClient& client : clients_) most = std::max(most, client.write(buffer, size));
    return most;
}

// ---- NetUDP -------------------------------------------------------------------------------------

std::uint8_t NetUDP::begin(std::uint16_t port) {
    socket_ = or_reported("udp.begin", port, network::udp_socket(port, std::nullopt));
    return socket_ ? 1 : 0;
}

std::uint8_t NetUDP::beginMulticast(IPAddress group, std::uint16_t port) {
    if (!can_reach("udp.beginMulticast", port, group)) return 0;
    socket_ =
        or_reported("udp.beginMulticast", port, network::udp_socket(port, static_cast<std::uint32_t>(group)));
    return socket_ ? 1 : 0;
}

void NetUDP::stop() {
    socket_.reset();
    in_size_ = in_read_ = out_size_ = 0;
}

int NetUDP::beginPacket(IPAddress address, std::uint16_t port) {
    if (!can_reach("udp.beginPacket", port, address)) return 0;
    to_address_ = address;
    to_port_ = port;
    out_size_ = 0;
    return socket_ ? 1 : 0;
}
int NetUDP::beginPacket(const char* host_name, std::uint16_t port) {
    const auto address = resolved(host_name);
    return address ? beginPacket(IPAddress(*address), port) : 0;
}

std::size_t NetUDP::write(const std::uint8_t* buffer, std::size_t size) {
    const std::size_t count = std::min(size, kPacketMax - out_size_);
    std::copy_n(buffer, count, out_.begin() + static_cast<std::ptrdiff_t>(out_size_));
    out_size_ += count;
    return count;
}

int NetUDP::endPacket() {
    asked();
    const bool sent = socket_ && socket_->send_to({to_address_, to_port_}, {out_.data(), out_size_});
    if (sent) moved(out_size_);
    return sent ? 1 : 0;
}

int NetUDP::parsePacket() {
    in_size_ = in_read_ = 0;
    Endpoint from;
    const auto size = socket_ ? socket_->receive_from(in_, from) : std::nullopt;
    if (!size) {
        asked();
        return 0;
    }
    remote_address_ = IPAddress(from.address);
    remote_port_ = from.port;
    in_size_ = moved(*size);
    return static_cast<int>(in_size_);
}

int NetUDP::read(unsigned char* buffer, std::size_t size) {
    const std::size_t count = std::min(size, in_size_ - in_read_);
    std::copy_n(in_.begin() + static_cast<std::ptrdiff_t>(in_read_), count, buffer);
    in_read_ += count;
    return static_cast<int>(count);
}

std::uint16_t NetUDP::localPort() const { return socket_ ? socket_->local().port : 0; }

IPAddress networkLocalIP() { return IPAddress(interface_of_host().address); }
IPAddress networkSubnetMask() { return IPAddress(interface_of_host().mask); }
IPAddress networkGatewayIP() {
    asked(kLongCalls);
    return IPAddress(network::gateway());
}
IPAddress networkNameServerIP() {
    asked(kLongCalls);
    return IPAddress(network::name_server());
}

void networkHardwareAddress(std::uint8_t* address) {
    const network::Interface interface = interface_of_host();
    std::ranges::copy(interface.hardware_address, address);
}

std::int32_t networkSignal() {
    asked(kLongCalls);
    return network::signal_dbm().value_or(0);
}

int networkHostByName(const char* host_name, IPAddress& address) {
    const auto found = resolved(host_name);
    if (found) address = IPAddress(*found);
    return found ? 1 : 0;
}
