// IPAddress, of both kinds. The system's own parser and writer are the oracles.
#include "arduino/libraries/network/IPAddress.h"

#include <arpa/inet.h>

#include <random>

#include "arduino/libraries/network/Ethernet.h"
#include "tests/unit/arduino/arduino_fixture.h"

namespace address_test {
namespace {

/// What a thing prints.
class Printed : public Print {
  public:
    explicit Printed(const Printable& thing) { print(thing); }
    std::size_t write(std::uint8_t value) override {
        text += static_cast<char>(value);
        return 1;
    }
    using Print::write;
    std::string text;
};

class ArduinoAddress : public ArduinoTest {};

TEST_F(ArduinoAddress, OfFourBytes) {
    const IPAddress address(192, 168, 0, 7);
    EXPECT_EQ(address.type(), IPv4);
    EXPECT_EQ(address.toString(), "192.168.0.7");
    EXPECT_EQ(Printed(address).text, "192.168.0.7");
    EXPECT_EQ(address[3], 7);
    EXPECT_EQ(IPAddress(static_cast<std::uint32_t>(address)), address);
    IPAddress parsed;
    EXPECT_TRUE(parsed.fromString("10.0.255.1"));
    EXPECT_EQ(parsed, IPAddress(10, 0, 255, 1));
    for (const char* bad :
         {"", "1.2.3", "1.2.3.4.5", "256.1.1.1", "1..2.3", "a.b.c.d", "1.2.3.4 ", "0001.2.3.4"}) {
        EXPECT_FALSE(parsed.fromString(bad)) << bad;
    }
    EXPECT_EQ(parsed, IPAddress(10, 0, 255, 1)) << "unchanged by what is no address";
}

TEST_F(ArduinoAddress, IsMadeOfBytesNumbersAndTextWithoutDoubt) {
    const std::uint8_t bytes[] = {192, 168, 1, 2};
    IPAddress address;
    address = bytes;
    EXPECT_EQ(address, IPAddress(192, 168, 1, 2));
    EXPECT_TRUE(address == bytes);
    address = std::uint32_t{0x0100'007f};
    EXPECT_EQ(address, IPAddress(127, 0, 0, 1));
    address = "10.1.2.3";
    EXPECT_EQ(address, IPAddress(10, 1, 2, 3));
    address = "fe80::1";
    EXPECT_EQ(address.type(), IPv6);
    address = {};
    EXPECT_EQ(address, IPAddress(0, 0, 0, 0));
    EXPECT_EQ(IPAddress(0), IPAddress(0, 0, 0, 0)) << "a number, not a null pointer";
    EXPECT_EQ(IPAddress("nobody"), IPAddress(0, 0, 0, 0));
}

TEST_F(ArduinoAddress, OfSixteenBytes) {
    const std::uint8_t bytes[] = {0x20, 1, 0xd, 0xb8, 1, 2, 3, 4, 5, 6, 7, 8, 9, 0xa, 0xb, 0xc};
    const IPAddress address(0x20, 1, 0xd, 0xb8, 1, 2, 3, 4, 5, 6, 7, 8, 9, 0xa, 0xb, 0xc);
    EXPECT_EQ(address.type(), IPv6);
    EXPECT_EQ(address, IPAddress(IPv6, bytes));
    for (int i = 0; i < 16; ++i) EXPECT_EQ(address[i], bytes[i]) << i;
    EXPECT_EQ(address.toString(), "2001:0db8:0102:0304:0506:0708:090a:0b0c");
    EXPECT_EQ(Printed(address).text, "2001:db8:102:304:506:708:90a:b0c");
    EXPECT_FALSE(address == bytes) << "four bytes are an IPv4 address";
    EXPECT_EQ(static_cast<std::uint32_t>(address), 0U);
    EXPECT_EQ(IPAddress(IPv6), IN6ADDR_ANY);
    EXPECT_FALSE(IPAddress(0, 0, 0, 1) == IPAddress(0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1));
}

TEST_F(ArduinoAddress, WhatIsNoIpv6AddressChangesNothing) {
    IPAddress address("fe80::7");
    for (const char* bad : {":", ":::", "::3:4:5:6::", "2001:db8:102:10304:506:708:90a:b0c",
                            "200x::", "1:2:3:4::5:6:7:8", "1:2:3:4:::7:8", "1:2:3:4:5:6:7:8:9",
                            "1:2:3:4:5:6:7:", "1:2:3:4:5:6:7", ":1:2:3:4:5:6:7", "::1 ", "-1::"}) {
        EXPECT_FALSE(address.fromString(bad)) << bad;
        std::array<std::uint8_t, 16> parsed;
        EXPECT_EQ(inet_pton(AF_INET6, bad, parsed.data()), 0) << bad;
    }
    EXPECT_EQ(Printed(address).text, "fe80::7");
}

TEST_F(ArduinoAddress, ReadsAndWritesAsTheSystemDoes) {
    const unsigned seed = 7;
    std::mt19937 random(seed);
    for (int round = 0; round < 2000; ++round) {
        std::array<std::uint8_t, 16> bytes{};
        for (std::size_t i = 0; i < 16; i += 2) {
            if (random() % 2 == 0) continue;  // zeros are what the short form is about
            bytes[i] = static_cast<std::uint8_t>(random() >> (random() % 9));
            bytes[i + 1] = static_cast<std::uint8_t>(random());
        }
        char text[INET6_ADDRSTRLEN] = {};
        inet_ntop(AF_INET6, bytes.data(), text, sizeof text);
        // The system writes some with an IPv4 tail.
        if (std::string_view(text).find('.') != std::string_view::npos) continue;
        const IPAddress address(IPv6, bytes.data());
        EXPECT_EQ(Printed(address).text, text) << "seed " << seed << ", round " << round;
        IPAddress parsed;
        EXPECT_TRUE(parsed.fromString(text)) << text;
        EXPECT_EQ(parsed, address) << text;
        EXPECT_TRUE(parsed.fromString(address.toString())) << text;
        EXPECT_EQ(parsed, address) << text;
    }
}

TEST_F(ArduinoAddress, RandomTextIsAnAddressWhenTheSystemSaysSo) {
    const unsigned seed = 11;
    std::mt19937 random(seed);
    int addresses = 0;
    for (int round = 0; round < 50'000; ++round) {
        std::string text;
        for (std::size_t left = 1 + random() % 12; left > 0; --left)
            text += random() % 10 == 0  ? "::"
                    : random() % 2 == 0 ? ":"
                                        : std::string(1, "0f8Ag"[random() % 5]);
        std::array<std::uint8_t, 16> bytes{};
        const bool is_address = inet_pton(AF_INET6, text.c_str(), bytes.data()) == 1;
        IPAddress parsed;
        ASSERT_EQ(parsed.fromString(text.c_str()), is_address) << text << ", seed " << seed;
        if (!is_address) continue;
        ++addresses;
        EXPECT_EQ(parsed, IPAddress(IPv6, bytes.data())) << text;
    }
    EXPECT_GT(addresses, 100);
}

TEST_F(ArduinoAddress, NobodyIsReachedByAnIpv6Address) {
    EthernetServer server(0);
    server.begin();
    EthernetClient client;
    EXPECT_EQ(client.connect(IPAddress("::1"), server.port()), 0);
    EthernetUDP udp;
    ASSERT_EQ(udp.begin(0), 1);
    EXPECT_EQ(udp.beginPacket(IPAddress("::1"), 7), 0);
    EXPECT_EQ(udp.beginMulticast(IPAddress("ff02::1"), 7), 0);
    EXPECT_EQ(errors().size(), 3U);
}

}  // namespace
}  // namespace address_test
