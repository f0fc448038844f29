// CAN frames, their ring, and the bus of the host: a pair of sockets stands for the bus, as this
// kernel may have none.
#include <linux/can.h>
#undef CAN_EFF_FLAG
#undef CAN_SFF_MASK
#undef CAN_EFF_MASK
#include <sys/socket.h>

#include <deque>
#include <random>

#include "arduino/RingBuffer.h"
#include "arduino/host/socket_can.h"
#include "arduino/libraries/CAN/Arduino_CAN.h"
#include "tests/unit/arduino/arduino_fixture.h"

namespace can_test {
namespace {

using qduino::arduino::host::SocketCan;
using qduino::posix::UniqueFd;

class ArduinoCan : public ArduinoTest {
  protected:
    void SetUp() override {
        ArduinoTest::SetUp();
        int ends[2];
        ASSERT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, ends), 0);
        other_.reset(ends[1]);
        port_ = SocketCan(UniqueFd(ends[0]));
    }
    void bus_sends(std::uint32_t id, const std::string& bytes) {
        can_frame frame{};
        frame.can_id = id;
        frame.can_dlc = static_cast<std::uint8_t>(bytes.size());
        bytes.copy(reinterpret_cast<char*>(frame.data), sizeof frame.data);
        ASSERT_EQ(send(other_.get(), &frame, sizeof frame, 0), static_cast<ssize_t>(sizeof frame));
    }
    UniqueFd other_;
    SocketCan port_;
};

TEST_F(ArduinoCan, AFrameHasItsIdentifierAndEightBytesAtMost) {
    const std::uint8_t bytes[] = {1, 2, 3, 4, 5, 6, 7, 8, 9};
    EXPECT_EQ(CanStandardId(0xFFF), 0x7FFU);
    EXPECT_EQ(CanExtendedId(0x3FFFFFFF), 0x9FFFFFFFU);
    const CanMsg standard(CanStandardId(0x20), 2, bytes);
    EXPECT_TRUE(standard.isStandardId());
    EXPECT_EQ(standard.getStandardId(), 0x20U);
    EXPECT_EQ(standard.data_length, 2);
    const CanMsg extended(CanExtendedId(0x20), sizeof bytes, bytes);
    EXPECT_TRUE(extended.isExtendedId());
    EXPECT_EQ(extended.getExtendedId(), 0x20U);
    EXPECT_EQ(extended.data_length, 8);
    EXPECT_EQ(extended.data[7], 8);
    const CanMsg empty(CanStandardId(1), 4, nullptr);
    for (const std::uint8_t value : empty.data) EXPECT_EQ(value, 0);
}

TEST_F(ArduinoCan, AFrameIsPrintedWithAsManyDigitsAsItsIdentifierHas) {
    struct Sink : Print {
        std::size_t write(std::uint8_t value) override {
            text += static_cast<char>(value);
            return 1;
        }
        using Print::write;
        std::string text;
    } sink;
    const std::uint8_t bytes[] = {0xDE, 0xAD, 0xC0, 0x0E};
    EXPECT_EQ(sink.print(CanMsg(CanStandardId(0x20), 2, bytes)), 16U);
    EXPECT_EQ(sink.text, "[020] (2) : DEAD");
    sink.text.clear();
    sink.print(CanMsg(CanExtendedId(0x1234ABCD), 4, bytes));
    EXPECT_EQ(sink.text, "[1234ABCD] (4) : DEADC00E");
}

TEST_F(ArduinoCan, TheRingKeepsTheFirst32InOrder) {
    CanMsgRingbuffer ring;
    EXPECT_TRUE(ring.isEmpty());
    EXPECT_EQ(ring.dequeue().data_length, 0);
    std::deque<std::uint32_t> kept;
    std::mt19937 random(3);
    for (std::uint32_t id = 0; id < 2000; ++id) {
        if (random() % 100 < 60) {
            ring.enqueue(CanMsg(CanStandardId(id), 0, nullptr));
            if (kept.size() < CanMsgRingbuffer::RING_BUFFER_SIZE) kept.push_back(CanStandardId(id));
        } else if (!kept.empty()) {
            ASSERT_EQ(ring.dequeue().id, kept.front());
            kept.pop_front();
        }
        ASSERT_EQ(ring.available(), kept.size());
        ASSERT_EQ(ring.isFull(), kept.size() == 32);
    }
}

TEST_F(ArduinoCan, FramesGoOutAsTheKernelHasThem) {
    const std::uint8_t bytes[] = {0xCA, 0xFE};
    EXPECT_EQ(port_.write(CanMsg(CanExtendedId(0x123456), 2, bytes)), CAN_SUCCESS);
    can_frame frame{};
    ASSERT_EQ(recv(other_.get(), &frame, sizeof frame, 0), static_cast<ssize_t>(sizeof frame));
    EXPECT_EQ(frame.can_id, 0x80123456U);
    EXPECT_EQ(frame.can_dlc, 2);
    EXPECT_EQ(frame.data[1], 0xFE);
    other_.reset();
    EXPECT_EQ(port_.write(CanMsg()), CAN_ERROR_GENERIC);
}

TEST_F(ArduinoCan, FramesComeInOrderAndErrorFramesDoNot) {
    EXPECT_EQ(port_.available(), 0U);
    EXPECT_EQ(port_.read().data_length, 0);
    for (std::uint32_t id = 0; id < 40; ++id) bus_sends(id, "ab");
    bus_sends(CAN_ERR_FLAG | 4, "bus off!");
    bus_sends(CAN_RTR_FLAG | 5, "");
    bus_sends(0x80000777U, "last");
    EXPECT_EQ(port_.available(), 32U) << "the others wait in the socket";
    for (std::uint32_t id = 0; id < 40; ++id) EXPECT_EQ(port_.read().getStandardId(), id);
    const CanMsg last = port_.read();
    EXPECT_EQ(last.getExtendedId(), 0x777U);
    EXPECT_EQ(std::string(reinterpret_cast<const char*>(last.data), last.data_length), "last");
    EXPECT_EQ(port_.available(), 0U);
}

TEST_F(ArduinoCan, AComputerWithoutThisBusSaysSo) {
    setenv("QDUINO_CAN", "nobus7", 1);
    EXPECT_FALSE(CAN.begin(CanBitRate::BR_250k));
    EXPECT_EQ(errors(), std::vector<std::string>{"CAN.begin(0)"});
    EXPECT_EQ(CAN.write(CanMsg()), CAN_ERROR_GENERIC);
    EXPECT_EQ(CAN.available(), 0U);
    unsetenv("QDUINO_CAN");
    CAN.end();
}

TEST_F(ArduinoCan, ABufferOfBytesKeepsAsManyAsItSays) {
    RingBufferN<5> ring;
    EXPECT_EQ(ring.read_char(), -1);
    EXPECT_EQ(ring.peek(), -1);
    for (std::uint8_t value = 1; value <= 9; ++value) ring.store_char(value);
    EXPECT_TRUE(ring.isFull());
    EXPECT_EQ(ring.available(), 5);
    EXPECT_EQ(ring.availableForStore(), 0);
    EXPECT_EQ(ring.peek(), 1);
    for (int value = 1; value <= 2; ++value) EXPECT_EQ(ring.read_char(), value);
    ring.store_char(0xFF);
    EXPECT_EQ(ring.availableForStore(), 1);
    for (const int value : {3, 4, 5, 0xFF, -1}) EXPECT_EQ(ring.read_char(), value);
    ring.store_char(1);
    ring.clear();
    EXPECT_EQ(ring.available(), 0);
    EXPECT_EQ(arduino::RingBuffer().availableForStore(), 64);
    RingBufferN<1> one;
    one.store_char(7);
    one.store_char(8);
    EXPECT_EQ(one.read_char(), 7);
    EXPECT_EQ(one.read_char(), -1);
}

}  // namespace
}  // namespace can_test
