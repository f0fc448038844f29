// The libraries: EEPROM, the character display, the touch sensor, the network, and the channels
// between loops.
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "arduino/Arduino.h"
#include "arduino/avr/eeprom.h"
#include "arduino/host/interface.h"
#include "arduino/libraries/CapacitiveSensor/CapacitiveSensor.h"
#include "arduino/libraries/EEPROM/EEPROM.h"
#include "arduino/libraries/LiquidCrystal/LiquidCrystal.h"
#include "arduino/libraries/network/Ethernet.h"
#include "arduino/libraries/network/WiFi.h"
#include "tests/unit/arduino/arduino_fixture.h"

namespace parts_test {
namespace {

class ArduinoParts : public ArduinoTest {};

std::string file_in_temp(const char* name) {
    return testing::TempDir() + "qduino-" + std::to_string(getpid()) + "-" + name;
}

/// Reads a display's pins as its controller does: at each falling edge of E.
struct DisplayReader {
    struct Transfer {
        bool is_character;
        int value;
        bool operator==(const Transfer&) const = default;
    };
    int rs, enable, d4;

    [[nodiscard]] std::vector<Transfer> nibbles() const {
        std::map<int, int> level;
        std::vector<Transfer> seen;
        for (const auto& event : qduino::fake::state().writes) {
            const bool falls = event.pin == enable && level[enable] == 1 && event.level == 0;
            if (falls) {
                int value = 0;
                for (int i = 0; i < 4; ++i) value |= level[d4 + i] << i;
                seen.push_back({level[rs] == 1, value});
            }
            level[event.pin] = event.level;
        }
        return seen;
    }
    /// Pairs of nibbles from `first` on.
    [[nodiscard]] std::vector<Transfer> bytes(std::size_t first) const {
        const auto halves = nibbles();
        std::vector<Transfer> whole;
        for (std::size_t i = first; i + 1 < halves.size(); i += 2) {
            whole.push_back({halves[i].is_character, halves[i].value << 4 | halves[i + 1].value});
        }
        return whole;
    }
};

TEST_F(ArduinoParts, EepromKeepsItsBytesInAFile) {
    const std::string path = file_in_temp("eeprom");
    ASSERT_TRUE(EEPROM.open(path.c_str()));
    EXPECT_EQ(EEPROM.read(0), 0xff) << "never written";
    EEPROM.write(10, 42);
    EEPROM[11] = 7;
    EEPROM[11] += 2;
    struct Settings {
        float gain;
        int count;
    };
    EEPROM.put(100, Settings{2.5F, 3});
    EEPROM.write(-1, 1);
    EEPROM.write(EEPROM.length(), 1);
    EEPROM.commit();
    ASSERT_TRUE(EEPROM.open(path.c_str())) << "as a second run of the program would";
    EXPECT_EQ(EEPROM.read(10), 42);
    EXPECT_EQ(EEPROM[11], 9);
    Settings read{};
    EEPROM.get(100, read);
    EXPECT_FLOAT_EQ(read.gain, 2.5F);
    EXPECT_EQ(read.count, 3);
    EXPECT_EQ(std::filesystem::file_size(path), 4096U);
    std::ifstream file(path, std::ios::binary);
    file.seekg(10);
    EXPECT_EQ(file.get(), 42) << "the file itself has it";
    int count = 0;
    for (EERef cell : EEPROM) count += cell == 0xff ? 0 : 1;
    EXPECT_EQ(count, 2 + 8);
    std::filesystem::remove(path);
}

std::uint16_t EEMEM kept_starts[2];
std::uint8_t EEMEM kept_byte;

TEST_F(ArduinoParts, AvrLibcsEepromIsTheSame) {
    const std::string path = file_in_temp("avr_eeprom");
    ASSERT_TRUE(EEPROM.open(path.c_str()));
    const auto at = [](std::size_t index) { return reinterpret_cast<std::uint8_t*>(index); };
    eeprom_write_byte(at(300), 0x12);
    eeprom_update_byte(at(301), 0x34);
    EXPECT_EQ(EEPROM.read(300), 0x12);
    EXPECT_EQ(eeprom_read_word(reinterpret_cast<std::uint16_t*>(at(300))), 0x3412);
    EXPECT_EQ(eeprom_read_byte(at(4096)), 0xff) << "behind its end";
    eeprom_write_byte(at(4096), 1);

    const std::size_t first = qduino_eeprom_index(kept_starts), byte = qduino_eeprom_index(&kept_byte);
    EXPECT_LT(first, 5U);
    EXPECT_LT(byte, 5U);
    EXPECT_EQ(qduino_eeprom_index(&kept_starts[1]), first + 2);
    eeprom_update_word(&kept_starts[1], 0xABCD);
    eeprom_update_byte(&kept_byte, 9);
    EXPECT_EQ(eeprom_read_word(&kept_starts[1]), 0xABCD);
    EXPECT_EQ(EEPROM.read(static_cast<int>(first) + 2), 0xCD);
    EXPECT_EQ(EEPROM.read(static_cast<int>(byte)), 9);
    std::uint8_t block[2];
    eeprom_read_block(block, &kept_starts[1], sizeof block);
    EXPECT_EQ(block[1], 0xAB);
    std::filesystem::remove(path);
}

TEST_F(ArduinoParts, EepromWithoutAFileSaysSoAndLivesInMemory) {
    EXPECT_FALSE(EEPROM.open("/proc/no/such/folder/eeprom"));
    EXPECT_EQ(errors(), std::vector<std::string>{"EEPROM(0)"});
    EEPROM.write(5, 55);
    EXPECT_EQ(EEPROM.read(5), 55);
}

TEST_F(ArduinoParts, TheDisplayGetsTheDataSheetsBytes) {
    LiquidCrystal lcd(12, 11, 2, 3, 4, 5);
    lcd.begin(16, 2);
    const DisplayReader reader{12, 11, 2};
    const auto wake = reader.nibbles();
    ASSERT_GE(wake.size(), 4U);
    for (int i = 0; i < 3; ++i) EXPECT_EQ(wake[static_cast<std::size_t>(i)].value, 3);
    EXPECT_EQ(wake[3].value, 2) << "then four bits";
    using T = DisplayReader::Transfer;
    EXPECT_EQ(reader.bytes(4), (std::vector<T>{{false, 0x28}, {false, 0x0c}, {false, 0x01}, {false, 0x06}}));
    board().writes.clear();
    lcd.setCursor(3, 1);
    lcd.print("Hi");
    lcd.cursor();
    lcd.scrollDisplayLeft();
    EXPECT_EQ(reader.bytes(0),
              (std::vector<T>{{false, 0x80 | 0x43}, {true, 'H'}, {true, 'i'}, {false, 0x0e}, {false, 0x18}}));
    board().writes.clear();
    const std::uint8_t bell[8] = {4, 14, 14, 14, 31, 0, 4, 0};
    lcd.createChar(2, bell);
    EXPECT_EQ(reader.bytes(0).front(), (T{false, 0x50}));
    EXPECT_EQ(reader.bytes(0).size(), 9U);
}

TEST_F(ArduinoParts, EnableIsHighLongEnough) {
    LiquidCrystal lcd(12, 11, 2, 3, 4, 5);
    lcd.begin(16, 2);
    std::int64_t rose = 0;
    for (const auto& event : board().writes) {
        if (event.pin != 11) continue;
        if (event.level == 1) rose = event.at_ns;
        if (event.level == 0 && rose > 0) {
            EXPECT_GE(event.at_ns - rose, 450);
        }
    }
}

TEST_F(ArduinoParts, ATouchTakesLongerToCharge) {
    // The receiving pin follows the sending one after `charge_us`.
    static std::int64_t charge_us = 20;
    board().level_of = [](int, qduino::Instant now) {
        std::int64_t changed = 0;
        int level = 0;
        for (const auto& event : qduino::fake::state().writes) {
            if (event.pin != 4) continue;
            if (event.level != level) changed = event.at_ns;
            level = event.level;
        }
        return qduino::to_ns(now) - changed >= charge_us * 1000 ? level : 1 - level;
    };
    CapacitiveSensor sensor(4, 2);
    EXPECT_EQ(sensor.capacitiveSensor(10), 0) << "the first reading is what untouched means";
    EXPECT_EQ(sensor.capacitiveSensorRaw(10), 400);
    charge_us = 50;
    EXPECT_EQ(sensor.capacitiveSensor(10), 600);
    sensor.set_CS_Timeout_Millis(1);
    charge_us = 5000;
    EXPECT_EQ(sensor.capacitiveSensor(10), -2);
}

TEST_F(ArduinoParts, AServerAndAClientOfThisMachine) {
    EthernetServer server(0);
    server.begin();
    ASSERT_TRUE(static_cast<bool>(server));
    EthernetClient client;
    ASSERT_EQ(client.connect(IPAddress(127, 0, 0, 1), server.port()), 1);
    EXPECT_FALSE(static_cast<bool>(server.available())) << "connected, but has sent nothing";
    client.println("GET /");
    EthernetClient served;
    for (int i = 0; i < 1000 && !served; ++i) {
        served = server.available();
        usleep(1000);
    }
    ASSERT_TRUE(static_cast<bool>(served));
    EXPECT_EQ(served.readStringUntil('\r'), "GET /");
    served.print("200 OK");
    client.setTimeout(100);
    char reply[7] = {};
    for (std::size_t got = 0; got < 6;) {  // over the real network: wait in real time
        const int count = client.read(reinterpret_cast<std::uint8_t*>(reply) + got, 6 - got);
        if (count > 0) got += static_cast<std::size_t>(count);
    }
    EXPECT_STREQ(reply, "200 OK");
    EXPECT_TRUE(client.connected());
    client.stop();
    EXPECT_FALSE(client.connected());
    EXPECT_EQ(client.write("x"), 0U);
    EXPECT_EQ(client.connect("127.0.0.1", 1), 0) << "nobody listens there";
    // The request with its line end, of which the reader leaves one byte; the answer, both ways.
    EXPECT_EQ(board().device_bytes[qduino::board::DeviceClass::nic], 7U + 6U + 6U + 6U);
}

TEST_F(ArduinoParts, AClientThatIsStoppedIsClosedThoughItsServerKnowsIt) {
    EthernetServer server(0);
    server.begin();
    EthernetClient client;
    ASSERT_EQ(client.connect(IPAddress(127, 0, 0, 1), server.port()), 1);
    client.println("GET /, and more than is read");
    EthernetClient served;
    for (int i = 0; i < 1000 && !served; ++i) {
        served = server.available();
        usleep(1000);
    }
    ASSERT_EQ(served.read(), 'G');
    served.stop();
    EXPECT_FALSE(static_cast<bool>(server.available())) << "what was not read is gone";
    for (int i = 0; i < 1000 && client.connected(); ++i) usleep(1000);
    EXPECT_FALSE(client.connected());
}

TEST_F(ArduinoParts, PacketsGoThereAndBack) {
    EthernetUDP here;
    EthernetUDP there;
    ASSERT_EQ(here.begin(0), 1);
    ASSERT_EQ(there.begin(0), 1);
    EXPECT_EQ(here.parsePacket(), 0);
    ASSERT_EQ(there.beginPacket(IPAddress(127, 0, 0, 1), here.localPort()), 1);
    there.print("ping ");
    there.print(7);
    EXPECT_EQ(there.endPacket(), 1);
    int size = 0;
    for (int i = 0; i < 1000 && size == 0; ++i) {
        size = here.parsePacket();
        usleep(1000);
    }
    EXPECT_EQ(size, 6);
    EXPECT_EQ(board().device_bytes[qduino::board::DeviceClass::nic], 12U) << "there, and here";
    char text[16] = {};
    EXPECT_EQ(here.read(text, 4), 4);
    EXPECT_STREQ(text, "ping");
    EXPECT_EQ(here.available(), 2);
    EXPECT_EQ(here.remotePort(), there.localPort());
    EXPECT_EQ(here.remoteIP(), IPAddress(127, 0, 0, 1));
    here.flush();
    EXPECT_EQ(here.read(), -1);
}

TEST_F(ArduinoParts, ARingRefusesOrWaitsOnlyWhenFullOrEmpty) {
    static RingBuffer<int, 5> ring;  // not a power of two
    for (int i = 0; i < 5; ++i) EXPECT_TRUE(ring.tryWrite(i));
    EXPECT_FALSE(ring.tryWrite(99));
    EXPECT_EQ(ring.available(), 5U);
    EXPECT_EQ(ring.availableForWrite(), 0U);
    // write() waits, asleep, until a reader made room at 3 ms.
    board().while_sleeping = [] {
        if (millis() == 3) {
            EXPECT_EQ(ring.read(), 0);
        }
    };
    EXPECT_TRUE(ring.write(5));
    EXPECT_EQ(millis(), 3UL);
    EXPECT_EQ(board().spun_ns, 0);
    board().while_sleeping = [] {};
    for (int i = 1; i <= 5; ++i) EXPECT_EQ(ring.read(), i);
    int item = 7;
    EXPECT_FALSE(ring.tryRead(item));
    board().stop = true;
    EXPECT_FALSE(ring.read(item)) << "a stopped sketch does not wait";
    EXPECT_EQ(item, 7);
}

TEST_F(ArduinoParts, QduinosNames) {
    static RingBuffer<long, 2> ring;
    ringbufInit(&ring);
    EXPECT_EQ(ringbufWrite(&ring, 1L), 0);
    EXPECT_EQ(ringbufWrite(&ring, 2L), 0);
    EXPECT_EQ(ringbufWrite(&ring, 3L), -1);
    long item = 0;
    EXPECT_EQ(ringbufRead(&ring, &item), 0);
    EXPECT_EQ(item, 1);
    static Channel<float> channel;
    channelInit(&channel);
    channelWrite(&channel, 1.5F);
    channelWrite(&channel, 2.5F);
    float value = 0;
    channelRead(&channel, &value);
    EXPECT_FLOAT_EQ(value, 2.5F) << "the freshest";
    EXPECT_FLOAT_EQ(channel.read(), 2.5F) << "and it stays";
    spinlock_t lock;
    spinlockInit(&lock);
    board().vcpu = 1;
    spinlockLock(&lock);
    board().vcpu = 2;
    EXPECT_FALSE(lock.tryLock());
    board().vcpu = 1;
    spinlockUnlock(&lock);
    board().vcpu = 2;
    EXPECT_TRUE(lock.tryLock());
    lock.unlock();
}

TEST_F(ArduinoParts, ALockIsRecursiveForItsHolderAlone) {
    qduino::arduino::Lock lock{"Lock", qduino::runtime::Unsaid::whole_budgets};
    board().vcpu = 3;
    lock.lock();
    EXPECT_TRUE(lock.try_lock());
    board().vcpu = 4;
    EXPECT_FALSE(lock.try_lock());
    board().vcpu = 3;
    lock.unlock();
    board().vcpu = 4;
    EXPECT_FALSE(lock.try_lock()) << "still held once";
    board().vcpu = 3;
    lock.unlock();
    board().vcpu = 4;
    EXPECT_TRUE(lock.try_lock());
    lock.unlock();
    EXPECT_DEATH(lock.unlock(), "owner_") << "a lock is released by its holder";
}

// ---- the host's interface -----------------------------------------------------------------------

TEST_F(ArduinoParts, TheHostsTablesAreRead) {
    namespace host = qduino::arduino::host;
    const char* route =
        "Iface\tDestination\tGateway \tFlags\tRefCnt\n"
        "eth1\t00000000\t0101A8C0\t0003\t0\n"
        "eth0\t0000A8C0\t00000000\t0001\t0\n"
        "eth0\t00000000\t0200A8C0\t0003\t0\n";
    EXPECT_EQ(IPAddress(host::gateway_in(route, "eth0")), IPAddress(192, 168, 0, 2));
    EXPECT_EQ(IPAddress(host::gateway_in(route, "eth1")), IPAddress(192, 168, 1, 1));
    EXPECT_EQ(host::gateway_in(route, "wlan0"), 0u);
    EXPECT_EQ(host::gateway_in("eth0\t00000000\tnonsense\n", "eth0"), 0u);
    EXPECT_EQ(IPAddress(host::name_server_in("# none\nsearch home\nnameserver ::1\nnameserver 9.8.7.6\n")),
              IPAddress(9, 8, 7, 6));
    EXPECT_EQ(host::name_server_in("nameserver\nnameserver x\n"), 0u);
    const char* wireless =
        "Inter-| sta-|   Quality        |\n face | tus | link level noise |\n wlan0: 0000   60.  -50.  -256  "
        "      0\n";
    EXPECT_EQ(host::signal_in(wireless, "wlan0"), -50);
    EXPECT_EQ(host::signal_in(wireless, "eth0"), std::nullopt);
}

TEST_F(ArduinoParts, WiFiIsTheHostsNetwork) {
    const byte bytes[4] = {10, 0, 0, 7};
    IPAddress address;
    address = bytes;
    EXPECT_EQ(address, IPAddress(10, 0, 0, 7));
    address = {};
    EXPECT_EQ(address, IPAddress());
    EXPECT_EQ(WiFi.hostByName("127.0.0.1", address), 1);
    EXPECT_EQ(address, IPAddress(127, 0, 0, 1));
    WiFi.begin("here", "secret");
    EXPECT_STREQ(WiFi.SSID(), "here");
    EXPECT_EQ(WiFi.scanNetworks(), -1);
    EXPECT_EQ(errors(), std::vector<std::string>{"WiFi.scanNetworks(0)"});
    byte ethernet[6] = {}, wifi[6] = {};
    Ethernet.MACAddress(ethernet);
    WiFi.macAddress(wifi);
    for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(wifi[i], ethernet[5 - i]);
}

}  // namespace
}  // namespace parts_test
