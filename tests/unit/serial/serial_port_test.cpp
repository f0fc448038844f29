// A pty as a host sees it: bytes as they are, and its coming and going are seen.
#include "serial/serial_port.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <array>
#include <filesystem>

namespace qduino::apps::serial_port_test {
namespace {

class SerialPortTest : public testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = (std::filesystem::temp_directory_path() / "serial-XXXXXX").string();
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        folder = pattern;
    }
    void TearDown() override { std::filesystem::remove_all(folder); }

    [[nodiscard]] static std::string read_all(const SerialPort& port) {
        std::array<char, 64> bytes{};
        std::string all;
        for (int tries = 0; tries < 1000; ++tries) {
            const auto count = port.read(bytes);
            if (!count.ok() || *count == 0) {
                if (!all.empty()) break;
                ::usleep(1000);
                continue;
            }
            all.append(bytes.data(), *count);
        }
        return all;
    }

    std::filesystem::path folder;
};

TEST_F(SerialPortTest, BytesPassAsTheyAre) {
    const auto port = SerialPort::make_pty(folder / "serial");
    ASSERT_TRUE(port.ok()) << port.error().message.view();
    const posix::UniqueFd host{::open((folder / "serial").c_str(), O_RDWR | O_NOCTTY)};
    ASSERT_TRUE(host.valid());
    const std::string all_bytes = "G1 X1\r\n\x03\x04\x11\x13\x1a\x7f\xff\n";
    ASSERT_EQ(::write(host.get(), all_bytes.data(), all_bytes.size()),
              static_cast<ssize_t>(all_bytes.size()));
    EXPECT_EQ(read_all(*port), all_bytes);
    EXPECT_EQ(port->write("ok\n"), 3u);
    std::array<char, 8> heard{};
    EXPECT_EQ(::read(host.get(), heard.data(), heard.size()), 3) << "no echo of what was written before";
    EXPECT_EQ(std::string(heard.data(), 3), "ok\n");
}

TEST_F(SerialPortTest, AHostIsSeenToComeAndGo) {
    auto port = SerialPort::make_pty(folder / "serial");
    ASSERT_TRUE(port.ok());
    EXPECT_TRUE(port->sees_host());
    for (int i = 0; i < 3; ++i) {
        EXPECT_FALSE(port->host_is_there());
        const posix::UniqueFd host{::open(port->name().c_str(), O_RDWR | O_NOCTTY)};
        EXPECT_TRUE(port->host_is_there());
    }
    EXPECT_FALSE(port->host_is_there());
    std::array<char, 8> bytes{};
    EXPECT_FALSE(port->read(bytes).ok());
}

TEST_F(SerialPortTest, TheLinkIsMadeAnew) {
    std::filesystem::create_symlink("/nowhere", folder / "serial");
    const auto port = SerialPort::make_pty(folder / "serial");
    ASSERT_TRUE(port.ok());
    EXPECT_EQ(std::filesystem::read_symlink(folder / "serial"), port->name());
    EXPECT_FALSE(SerialPort::make_pty(folder / "no" / "serial").ok());
}

TEST_F(SerialPortTest, ADeviceIsOpenedAtItsBaudRate) {
    const auto pty = SerialPort::make_pty(folder / "serial");  // stands for a UART
    ASSERT_TRUE(pty.ok());
    auto device = SerialPort::open_device(pty->name() + "@115200");
    ASSERT_TRUE(device.ok()) << device.error().message.view();
    EXPECT_FALSE(device->sees_host());
    EXPECT_TRUE(device->host_is_there());
    EXPECT_EQ(device->write("M105\n"), 5u);
    EXPECT_EQ(read_all(*pty), "M105\n");
    EXPECT_FALSE(SerialPort::open_device("/dev/no-such-port").ok());
    EXPECT_EQ(SerialPort::open_device("/dev/null@fast").error().code, ErrorCode::invalid_argument);
    EXPECT_FALSE(SerialPort::open_device("/dev/null").ok()) << "no terminal";
}

}  // namespace
}  // namespace qduino::apps::serial_port_test
