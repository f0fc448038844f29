// The Ethernet library's names for the network (Network.h). The host has configured the interface,
// so begin() says yes, and the address that a sketch asks for is not imposed on the host.
#pragma once

#include "arduino/Network.h"

using EthernetClient = NetClient;
using EthernetServer = NetServer;
using EthernetUDP = NetUDP;

enum EthernetLinkStatus { Unknown, LinkON, LinkOFF };
enum EthernetHardwareStatus { EthernetNoHardware, EthernetW5100, EthernetW5200, EthernetW5500 };

class EthernetClass {
  public:
    /// 1 when the computer has an address.
    int begin(const std::uint8_t* /*mac*/) { return linkStatus() == LinkON ? 1 : 0; }
    template <typename... Addresses>
    void begin(const std::uint8_t* /*mac*/, IPAddress, Addresses...) {}
    void init(std::uint8_t /*select_pin*/) {}
    int maintain() { return 0; }
    [[nodiscard]] IPAddress localIP() const { return networkLocalIP(); }
    [[nodiscard]] EthernetLinkStatus linkStatus() const {
        return localIP() == IPAddress() ? LinkOFF : LinkON;
    }
    [[nodiscard]] EthernetHardwareStatus hardwareStatus() const { return EthernetW5500; }
};

inline EthernetClass Ethernet;
