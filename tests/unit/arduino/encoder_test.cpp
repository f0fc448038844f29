// Encoder: each step of the library's table, and a random walk that handlers and read() follow
// together.
#include "arduino/libraries/Encoder/Encoder.h"

#include <array>
#include <limits>
#include <random>
#include <utility>

#include "tests/unit/arduino/arduino_fixture.h"

namespace encoder_test {
namespace {

/// An encoder's two lines, pin 1 in the lowest bit.
class ArduinoEncoder : public ArduinoTest {
  protected:
    ArduinoEncoder() {
        board().level_of = [this](int pin, qduino::Instant) { return lines_ >> (pin % 2) & 1; };
    }
    void set(unsigned lines) { lines_ = static_cast<int>(lines); }
    /// Sets the lines, and calls the handlers of the pins that have changed since the last call.
    void turn_to(unsigned lines) {
        set(lines);
        const int changed = std::exchange(told_, lines_) ^ lines_;
        for (const qduino::fake::AttachedEdge& edge : board().attached) {
            if ((changed >> (edge.pin % 2) & 1) != 0) edge.handler(edge.context);
        }
    }

  private:
    int lines_ = 0, told_ = 0;
};

/// The lines on the way up, a quarter of a period each.
constexpr std::array<unsigned, 4> kWayUp{0b00, 0b10, 0b11, 0b01};

// The table in the library's header: by the new lines, then the old.
TEST_F(ArduinoEncoder, EachStepIsTheLibrarys) {
    constexpr std::array<std::array<int, 4>, 4> kStep{
        {{0, 1, -1, 2}, {-1, 0, -2, 1}, {1, -2, 0, -1}, {2, -1, 1, 0}}};
    for (unsigned old = 0; old < 4; ++old) {
        for (unsigned now = 0; now < 4; ++now) {
            set(old);
            Encoder encoder(4, 5, false);
            set(now);
            EXPECT_EQ(encoder.read(), kStep[now][old]) << old << " to " << now;
            EXPECT_EQ(encoder.read(), kStep[now][old]) << "looked at twice";
        }
    }
    EXPECT_TRUE(board().attached.empty()) << "without interrupts";
}

TEST_F(ArduinoEncoder, HandlersAndReadFollowTogether) {
    const unsigned seed = 11;
    std::mt19937 random(seed);
    Encoder encoder(4, 5);
    ASSERT_EQ(board().attached.size(), 2U);
    EXPECT_EQ(board().modes[4], qduino::board::PinMode::input_pullup);
    EXPECT_EQ(board().modes[5], qduino::board::PinMode::input_pullup);
    int place = 0, shown = 0;
    for (int i = 0; i < 20'000; ++i) {
        const int way = random() % 3 == 0 ? -1 : 1;
        place += way;
        shown += way;
        const unsigned lines = kWayUp[static_cast<std::size_t>(place & 3)];
        if (random() % 4 == 0) {
            set(lines);  // read() comes before the handler
            ASSERT_EQ(encoder.read(), shown) << "seed " << seed << ", step " << i;
        }
        turn_to(lines);
        if (random() % 50 == 0) {
            ASSERT_EQ(encoder.readAndReset(), shown) << "seed " << seed << ", step " << i;
            shown = 0;
        }
        if (random() % 50 == 0) encoder.write(shown = static_cast<int>(random() % 2000) - 1000);
    }
    EXPECT_EQ(encoder.read(), shown);
}

TEST_F(ArduinoEncoder, ThePositionWraps) {
    Encoder encoder(4, 5);
    encoder.write(std::numeric_limits<std::int32_t>::max());
    turn_to(kWayUp[1]);
    EXPECT_EQ(encoder.read(), std::numeric_limits<std::int32_t>::min());
}

TEST_F(ArduinoEncoder, EachHasItsOwnPosition) {
    Encoder one(4, 5), other(7, 6);  // the same two lines the other way round
    turn_to(kWayUp[1]);
    turn_to(kWayUp[2]);
    EXPECT_EQ(one.read(), 2);
    EXPECT_EQ(other.read(), -2);
}

}  // namespace
}  // namespace encoder_test
