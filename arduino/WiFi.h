// The WiFi library's names for the network (Network.h). The host has joined its network already.
// begin() does not join the one that a sketch names, and says connected when the computer has an
// address.
#pragma once

#include "arduino/Network.h"

using WiFiClient = NetClient;
using WiFiServer = NetServer;
using WiFiUDP = NetUDP;

enum wl_status_t {
    WL_IDLE_STATUS = 0,
    WL_NO_SSID_AVAIL = 1,
    WL_CONNECTED = 3,
    WL_CONNECT_FAILED = 4,
    WL_DISCONNECTED = 6
};

class WiFiClass {
  public:
    wl_status_t begin(const char* /*network*/ = "", const char* /*password*/ = "") { return status(); }
    void disconnect() {}
    [[nodiscard]] wl_status_t status() const {
        return localIP() == IPAddress() ? WL_DISCONNECTED : WL_CONNECTED;
    }
    [[nodiscard]] IPAddress localIP() const { return networkLocalIP(); }
};

inline WiFiClass WiFi;
