// Serial: bytes through a port of memory, and through a real pseudo-terminal and pipe of the host.
#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <thread>

#include "arduino/HardwareSerial.h"
#include "arduino/host/serial_ports.h"
#include "tests/unit/arduino/arduino_fixture.h"
#include "tests/unit/arduino/memory_port.h"

namespace serial_test {
namespace {

using qduino::Result;
using qduino::test::MemoryPort;

class ArduinoSerial : public ArduinoTest {
  protected:
    MemoryPort port;
    HardwareSerial serial{1};
};

/// What arrives at `descriptor` until `size` bytes are there (at most some seconds).
std::string read_exactly(int descriptor, std::size_t size) {
    std::string text;
    char buffer[256];
    pollfd look{descriptor, POLLIN, 0};
    while (text.size() < size && poll(&look, 1, 5000) == 1) {
        const ssize_t count = read(descriptor, buffer, sizeof buffer);
        if (count <= 0) break;
        text.append(buffer, static_cast<std::size_t>(count));
    }
    return text;
}

/// A port over two pipes.
class PipePort final : public qduino::arduino::host::DescriptorPort {
  public:
    PipePort() : DescriptorPort(qduino::arduino::host::WhenFull::wait) {}
    ~PipePort() override {
        close();
        for (const int descriptor : {in[0], in[1], out[0], out[1]}) {
            if (descriptor >= 0) ::close(descriptor);
        }
    }
    Result<void> open(unsigned long, std::uint16_t) override {
        if (pipe(in) != 0 || pipe(out) != 0)
            return qduino::make_error(qduino::ErrorCode::unavailable, "pipe");
        return start(in[0], out[1]);
    }
    int in[2] = {-1, -1};
    int out[2] = {-1, -1};
};

TEST_F(ArduinoSerial, BeginOpensThePortAndEndClosesIt) {
    EXPECT_FALSE(static_cast<bool>(serial));
    EXPECT_EQ(serial.println("lost"), 0U) << "before begin() nothing goes out";
    serial.begin(115200, SERIAL_7E1, port);
    EXPECT_TRUE(static_cast<bool>(serial));
    EXPECT_EQ(port.opened_with, 115200UL);
    EXPECT_EQ(port.opened_config, SERIAL_7E1);
    serial.end();
    EXPECT_TRUE(port.closed);
    EXPECT_EQ(serial.read(), -1);
}

TEST_F(ArduinoSerial, TheBoardIsToldOfEachByteThatGoesThrough) {
    EXPECT_EQ(serial.println("lost"), 0U);
    EXPECT_TRUE(board().device_bytes.empty());
    serial.begin(9600, SERIAL_8N1, port);
    serial.print("four");
    port.input = "ab";
    for (int i = 0; i < 3; ++i) static_cast<void>(serial.read());
    EXPECT_EQ(board().device_bytes[qduino::board::DeviceClass::uart], 6U);
}

TEST_F(ArduinoSerial, APortThatCannotBeOpenedIsReported) {
    port.refuse = true;
    serial.begin(9600, SERIAL_8N1, port);
    EXPECT_FALSE(static_cast<bool>(serial));
    EXPECT_EQ(errors(), std::vector<std::string>{"Serial.begin(1)"});
}

TEST_F(ArduinoSerial, BytesBothWays) {
    serial.begin(9600, SERIAL_8N1, port);
    serial.print("x = ");
    serial.println(42);
    serial.write(0);
    serial.write('!');
    serial.write(65);
    serial.flush();
    EXPECT_EQ(port.output, std::string("x = 42\r\n\0!A", 11));
    EXPECT_EQ(port.flushes, 1);
    port.input = "17,\xff";
    EXPECT_EQ(serial.available(), 4);
    EXPECT_EQ(serial.parseInt(), 17);
    EXPECT_EQ(serial.peek(), ',');
    EXPECT_EQ(serial.read(), ',');
    EXPECT_EQ(serial.read(), 0xff);
    EXPECT_EQ(serial.read(), -1);
    EXPECT_EQ(serial.availableForWrite(), 64);
}

TEST_F(ArduinoSerial, APipeCarriesWhatDoesNotFitInTheRing) {
    PipePort pipe_port;
    ASSERT_TRUE(pipe_port.open(0, 0).ok());
    std::string sent;
    // 168 KB: more than ring and pipe hold.
    for (int i = 0; i < 30'000; ++i) sent += std::to_string(i) + "\n";
    std::thread writer([&] {
        const auto* bytes = reinterpret_cast<const std::uint8_t*>(sent.data());
        EXPECT_EQ(pipe_port.write({bytes, sent.size()}), sent.size());
        pipe_port.flush();
    });
    EXPECT_EQ(read_exactly(pipe_port.out[0], sent.size()), sent);
    writer.join();
}

TEST_F(ArduinoSerial, ReadingAPipeNeverWaits) {
    PipePort pipe_port;
    ASSERT_TRUE(pipe_port.open(0, 0).ok());
    EXPECT_EQ(pipe_port.available(), 0U);
    EXPECT_EQ(pipe_port.read(), -1);
    ASSERT_EQ(write(pipe_port.in[1], "ab", 2), 2);
    EXPECT_EQ(pipe_port.available(), 2U);
    EXPECT_EQ(pipe_port.read(), 'a');
    close(pipe_port.in[1]);
    pipe_port.in[1] = -1;
    EXPECT_EQ(pipe_port.read(), 'b');
    EXPECT_EQ(pipe_port.read(), -1) << "at the end of the input";
}

TEST_F(ArduinoSerial, AReaderThatWentAwayDoesNotStopTheWriter) {
    PipePort pipe_port;
    ASSERT_TRUE(pipe_port.open(0, 0).ok());
    close(pipe_port.out[0]);
    pipe_port.out[0] = -1;
    const std::vector<std::uint8_t> many(200'000, 'x');
    EXPECT_EQ(pipe_port.write(many), many.size());
    pipe_port.flush();
}

TEST_F(ArduinoSerial, APseudoTerminalIsASerialPort) {
    const std::string link = testing::TempDir() + "qduino-serial-" + std::to_string(getpid());
    qduino::arduino::host::PseudoTerminalPort pseudo(link);
    serial.begin(115200, SERIAL_8N1, pseudo);
    ASSERT_TRUE(static_cast<bool>(serial)) << (errors().empty() ? "" : errors()[0]);
    const int other_end = open(link.c_str(), O_RDWR | O_NOCTTY);
    ASSERT_GE(other_end, 0);
    serial.println("hello");
    EXPECT_EQ(read_exactly(other_end, 7), "hello\r\n") << "raw: nothing is translated";
    ASSERT_EQ(write(other_end, "M105\n", 5), 5);
    while (serial.available() < 5) std::this_thread::yield();
    EXPECT_EQ(serial.readStringUntil('\n'), "M105");
    close(other_end);
    serial.end();
    EXPECT_NE(access(link.c_str(), F_OK), 0) << "the link is gone with the port";
}

TEST_F(ArduinoSerial, ARealPortSaysWhatIsWrong) {
    qduino::arduino::host::TerminalPort missing("/dev/no-such-port");
    const auto opened = missing.open(9600, SERIAL_8N1);
    ASSERT_FALSE(opened.ok());
    EXPECT_EQ(opened.error().code, qduino::ErrorCode::not_found);
    qduino::arduino::host::PseudoTerminalPort pseudo("");
    ASSERT_TRUE(pseudo.open(9600, SERIAL_8N1).ok());
    qduino::arduino::host::TerminalPort terminal(pseudo.name());
    EXPECT_EQ(terminal.open(12345, SERIAL_8N1).error().code, qduino::ErrorCode::invalid_argument);
    ASSERT_TRUE(terminal.open(57600, SERIAL_8E2).ok());
    const std::uint8_t text[] = {'o', 'k'};
    EXPECT_EQ(terminal.write(text), 2U);
    while (pseudo.available() < 2) std::this_thread::yield();
    EXPECT_EQ(pseudo.read(), 'o');
}

}  // namespace
}  // namespace serial_test
