// The Ethernet library's names for the network (Network.h). The host has configured the interface,
// so begin() says yes, and the address that a sketch asks for is not imposed on the host.
#pragma once

#include "arduino/libraries/network/Network.h"

using EthernetClient = NetClient;
using EthernetServer = NetServer;
using EthernetUDP = NetUDP;

enum EthernetLinkStatus { Unknown, LinkON, LinkOFF };
enum EthernetHardwareStatus { EthernetNoHardware, EthernetW5100, EthernetW5200, EthernetW5500 };

class EthernetClass {
  public:
    /// 1 when the computer has an address. The times are those of a request for one.
    int begin(const std::uint8_t* /*mac*/, unsigned long /*timeout_ms*/ = 60000,
              unsigned long /*answer_ms*/ = 4000) {
        return linkStatus() == LinkON ? 1 : 0;
    }
    template <typename... Addresses>
    void begin(const std::uint8_t* /*mac*/, IPAddress, Addresses...) {}
    void init(std::uint8_t /*select_pin*/) {}
    int maintain() { return 0; }
    [[nodiscard]] IPAddress localIP() const { return networkLocalIP(); }
    [[nodiscard]] IPAddress subnetMask() const { return networkSubnetMask(); }
    [[nodiscard]] IPAddress gatewayIP() const { return networkGatewayIP(); }
    [[nodiscard]] IPAddress dnsServerIP() const { return networkNameServerIP(); }
    /// Fills `address`, 6 bytes.
    void MACAddress(std::uint8_t* address) const { networkHardwareAddress(address); }
    void setMACAddress(const std::uint8_t*) {}
    void setLocalIP(IPAddress) {}
    void setSubnetMask(IPAddress) {}
    void setGatewayIP(IPAddress) {}
    void setDnsServerIP(IPAddress) {}
    void setRetransmissionTimeout(std::uint16_t) {}
    void setRetransmissionCount(std::uint8_t) {}
    [[nodiscard]] EthernetLinkStatus linkStatus() const {
        return localIP() == IPAddress() ? LinkOFF : LinkON;
    }
    [[nodiscard]] EthernetHardwareStatus hardwareStatus() const { return EthernetW5500; }
};

inline EthernetClass Ethernet;
