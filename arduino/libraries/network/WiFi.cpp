#include "arduino/libraries/network/WiFi.h"

#include <algorithm>

#include "arduino/core/diagnostics.h"

WiFiClass WiFi QDUINO_BEFORE_SKETCH;

wl_status_t WiFiClass::begin(const char* network, const char*) {
    network_ = network;
    return status();
}

std::uint8_t* WiFiClass::macAddress(std::uint8_t* address) const {
    networkHardwareAddress(address);
    std::reverse(address, address + WL_MAC_ADDR_LENGTH);
    return address;
}

String WiFiClass::macAddress() const {
    std::uint8_t address[WL_MAC_ADDR_LENGTH] = {};
    networkHardwareAddress(address);
    String text;
    for (const std::uint8_t part : address) {
        if (text.length() != 0) text += ':';
        if (part < 0x10) text += '0';
        text += String(part, HEX);
    }
    text.toUpperCase();
    return text;
}

bool WiFiClass::mode(WiFiMode_t mode) {
    if (mode == WIFI_STA) return true;
    return qduino::arduino::refuse("WiFi.mode", mode, qduino::ErrorCode::unsupported,
                                   "the host's radio is its own: the sketch can only be a station");
}

std::uint8_t* WiFiClass::BSSID(std::uint8_t* address) const {
    std::fill_n(address, WL_MAC_ADDR_LENGTH, std::uint8_t{0});
    return address;
}

std::int8_t WiFiClass::scanNetworks() {
    qduino::arduino::refuse("WiFi.scanNetworks", 0, qduino::ErrorCode::unsupported,
                            "the host looks for networks, not the sketch ('iw dev' there)");
    return -1;
}
