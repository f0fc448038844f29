// The WiFi library's names for the network (Network.h). The host has joined its network already.
// begin() does not join the one that a sketch names, and says connected when the computer has an
// address. Networks around are the host's business: scanNetworks() finds none, and says so.
#pragma once

#include "arduino/libraries/network/Network.h"

using WiFiClient = NetClient;
using WiFiServer = NetServer;
using WiFiUDP = NetUDP;

#define WL_SSID_MAX_LENGTH 32
#define WL_WPA_KEY_MAX_LENGTH 63
#define WL_MAC_ADDR_LENGTH 6
#define WL_MAX_SSID_CONNECTED 1
#define WL_FW_VER_LENGTH 6
#define WIFI_FIRMWARE_LATEST_VERSION "1.1.0"

// As the library numbers them (arduino.cc, "WiFi library").
enum wl_status_t {
    WL_NO_SHIELD = 255,
    WL_NO_MODULE = WL_NO_SHIELD,
    WL_IDLE_STATUS = 0,
    WL_NO_SSID_AVAIL = 1,
    WL_SCAN_COMPLETED = 2,
    WL_CONNECTED = 3,
    WL_CONNECT_FAILED = 4,
    WL_CONNECTION_LOST = 5,
    WL_DISCONNECTED = 6
};
enum wl_enc_type {
    ENC_TYPE_TKIP = 2,
    ENC_TYPE_CCMP = 4,
    ENC_TYPE_WEP = 5,
    ENC_TYPE_NONE = 7,
    ENC_TYPE_AUTO = 8
};
enum WiFiMode_t { WIFI_OFF = 0, WIFI_STA = 1, WIFI_AP = 2, WIFI_AP_STA = 3 };
enum wl_tcp_state { CLOSED = 0, LISTEN = 1, ESTABLISHED = 4 };

class WiFiClass {
  public:
    /// `key` and its index change nothing: the host holds the keys.
    wl_status_t begin(const char* network = "", const char* /*key*/ = "");
    wl_status_t begin(const char* network, std::uint8_t /*key_index*/, const char* key) {
        return begin(network, key);
    }
    template <typename... Addresses>
    void config(IPAddress, Addresses...) {}  // the host has configured it
    void setDNS(IPAddress, IPAddress = {}) {}
    void setHostname(const char*) {}
    void lowPowerMode() {}
    void noLowPowerMode() {}
    int disconnect() { return WL_DISCONNECTED; }
    void end() {}

    [[nodiscard]] wl_status_t status() const {
        return localIP() == IPAddress() ? WL_DISCONNECTED : WL_CONNECTED;
    }
    [[nodiscard]] const char* firmwareVersion() const { return WIFI_FIRMWARE_LATEST_VERSION; }
    [[nodiscard]] IPAddress localIP() const { return networkLocalIP(); }
    [[nodiscard]] IPAddress subnetMask() const { return networkSubnetMask(); }
    [[nodiscard]] IPAddress gatewayIP() const { return networkGatewayIP(); }
    [[nodiscard]] IPAddress dnsIP(int = 0) const { return networkNameServerIP(); }
    /// Fills `address`, 6 bytes, the last of the hardware address first, as the library has it.
    std::uint8_t* macAddress(std::uint8_t* address) const;
    /// 1 and the address of `host`; 0 when nobody knows it.
    int hostByName(const char* host, IPAddress& address) const { return networkHostByName(host, address); }

    /// What begin() named.
    [[nodiscard]] const char* SSID() const { return network_.c_str(); }
    /// The hardware address of the access point: zeros, because the host does not say.
    std::uint8_t* BSSID(std::uint8_t* address) const;
    /// The signal in dBm; 0 where the network has no radio.
    [[nodiscard]] std::int32_t RSSI() const { return networkSignal(); }
    [[nodiscard]] std::uint8_t encryptionType() const { return ENC_TYPE_AUTO; }

    /// The number of networks around, reported as unknown: −1.
    std::int8_t scanNetworks();
    [[nodiscard]] const char* SSID(std::uint8_t) const { return nullptr; }
    [[nodiscard]] std::int32_t RSSI(std::uint8_t) const { return 0; }
    [[nodiscard]] std::uint8_t encryptionType(std::uint8_t) const { return ENC_TYPE_AUTO; }
    [[nodiscard]] std::uint8_t channel(std::uint8_t) const { return 0; }

    // ---- What the ESP8266's and ESP32's WiFi has besides
    /// The radio is the host's, and a station: a sketch that wants an access point is told no.
    bool mode(WiFiMode_t mode);
    [[nodiscard]] WiFiMode_t getMode() const { return WIFI_STA; }
    [[nodiscard]] bool isConnected() const { return status() == WL_CONNECTED; }
    /// The host joined before the sketch began: there is nothing to wait for.
    [[nodiscard]] wl_status_t waitForConnectResult(unsigned long = 0) const { return status(); }
    bool reconnect() { return isConnected(); }
    bool disconnect(bool) { return false; }  // the host stays in its network
    bool setAutoReconnect(bool) { return true; }
    bool setAutoConnect(bool) { return true; }
    void persistent(bool) {}
    bool setSleep(bool) { return true; }
    bool hostname(const char*) { return false; }  // the host has its name
    /// As text, the first byte of the address first: "AA:BB:CC:DD:EE:FF".
    [[nodiscard]] String macAddress() const;

  private:
    String network_;
};

extern WiFiClass WiFi;
