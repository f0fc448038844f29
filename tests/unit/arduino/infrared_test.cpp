// NEC's code: what is encoded is decoded, in spite of a receiver's errors; and what is no frame.
#include <random>
#include <vector>

#include "arduino/libraries/IRremote/IRremote.hpp"
#include "tests/unit/arduino/arduino_fixture.h"

namespace infrared_test {
namespace {

namespace nec = qduino::arduino::nec;
using qduino::Nanoseconds;

struct Length {
    bool mark;
    Nanoseconds length;
};

std::vector<Length> lengths_of(nec::Frame frame) {
    std::vector<Length> lengths;
    nec::encode(frame, [&](bool mark, Nanoseconds length) { lengths.push_back({mark, length}); });
    return lengths;
}
/// The frames in these lengths, after a pause.
std::vector<nec::Frame> frames_in(const std::vector<Length>& lengths) {
    nec::Decoder decoder;
    std::vector<nec::Frame> frames;
    const auto feed = [&](Length length) {
        if (const auto frame = decoder.feed(length.mark, length.length)) frames.push_back(*frame);
    };
    feed({false, 1s});
    for (const Length& length : lengths) feed(length);
    return frames;
}

TEST(ArduinoInfrared, WhatIsEncodedIsDecoded) {
    const unsigned seed = 3;
    std::mt19937 random(seed);
    for (int round = 0; round < 500; ++round) {
        const auto raw = static_cast<std::uint32_t>(random());
        auto lengths = lengths_of({.raw = raw, .is_repeat = false});
        ASSERT_EQ(lengths.size(), 67u);
        // Marks come out longer than they were, spaces shorter, and both with some noise.
        for (Length& length : lengths) {
            length.length += (length.mark ? 1 : -1) * Nanoseconds{90'000};
            length.length += Nanoseconds{static_cast<std::int64_t>(random() % 180'000) - 90'000};
        }
        const auto frames = frames_in(lengths);
        ASSERT_EQ(frames.size(), 1u) << "seed " << seed << ", round " << round;
        EXPECT_EQ(frames[0].raw, raw);
        EXPECT_FALSE(frames[0].is_repeat);
    }
    const auto repeat = frames_in(lengths_of({.raw = 0, .is_repeat = true}));
    ASSERT_EQ(repeat.size(), 1u);
    EXPECT_TRUE(repeat[0].is_repeat);
}

TEST(ArduinoInfrared, ALengthThatDoesNotFitEndsTheFrame) {
    const auto whole = lengths_of({.raw = 0x12345678, .is_repeat = false});
    for (std::size_t i = 0; i < whole.size(); ++i) {
        auto lengths = whole;
        lengths[i].length = 3ms;  // neither of a mark nor of a space
        EXPECT_TRUE(frames_in(lengths).empty()) << i;
        auto cut = std::vector(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(i));
        EXPECT_TRUE(frames_in(cut).empty()) << i;
        cut.insert(cut.end(), whole.begin(), whole.end());
        EXPECT_EQ(frames_in(cut).size(), 1u) << "a frame may begin anew: " << i;
    }
}

class ArduinoInfraredSent : public ArduinoTest {};

/// (light, µs) from the PWM's duties.
TEST_F(ArduinoInfraredSent, RawLengthsAsTheyAre) {
    IRsend sender;
    sender.begin(3, DISABLE_LED_FEEDBACK);
    const std::uint16_t lengths[] = {9000, 4500, 560};
    const qduino::Instant from = board().now;
    board().pwm.clear();
    sender.sendRaw(lengths, 3, 40);
    EXPECT_EQ(board().now - from, qduino::Nanoseconds{14'060'000});
    EXPECT_EQ(board().pwm_periods.back(), (qduino::fake::PwmPeriod{3, 25'000}));
    EXPECT_EQ(sender.periodTimeMicros, 25U);
    std::vector<bool> light;
    for (const auto& event : board().pwm) light.push_back(event.duty > 0);
    EXPECT_EQ(light, (std::vector<bool>{true, false, true, false}));
    const std::uint8_t ticks[] = {20, 10};
    const qduino::Instant next = board().now;
    sender.sendRaw(ticks, 2, 38);
    EXPECT_EQ(board().now - next, qduino::Nanoseconds{1'500'000});
    const qduino::Instant repeated = board().now;
    sender.sendRaw(lengths, 3, 38, 20, 1);
    EXPECT_EQ(board().now - repeated, qduino::Nanoseconds{34'060'000}) << "the second one after 20 ms";
    sender.sendRaw_P(ticks, 2, 38, 1, 2);
    EXPECT_EQ(board().now - repeated, qduino::Nanoseconds{38'560'000}) << "at once: a frame takes longer";
    EXPECT_TRUE(errors().empty());
}

TEST(ArduinoInfrared, WhatSketchesComputeWithIsThere) {
    static_assert(bitreverse32Bit(0x80000003U) == 0xC0000001U);
    static_assert(IRsend::computeOpenLASIRRawCommand(0x12, OPENLASIR_MODE_COLOR_SET_PERMANENT,
                                                     OPENLASIR_COLOR_WHITE) == 0xEA12);
}

TEST_F(ArduinoInfraredSent, AnotherProtocolIsReported) {
    IRsend sender;
    sender.begin(3);
    board().pwm.clear();
    sender.sendSony(1, 2, 3);
    EXPECT_EQ(sender.write(SONY, 1, 2), 0U);
    EXPECT_EQ(errors(), (std::vector<std::string>{"IRremote(0)", "IRremote(0)"}));
    EXPECT_TRUE(board().pwm.empty());
    EXPECT_EQ(sender.write(NEC, 1, 2), 1U);
    EXPECT_EQ(board().pwm.size(), 68U) << "33 marks, 33 spaces; the last mark, and dark again";
    EXPECT_STREQ(reinterpret_cast<const char*>(getProtocolString(OPENLASIR)), "OpenLASIR");
}

TEST(ArduinoInfrared, TheCommandHasItsInverseBehindIt) { EXPECT_EQ(nec::raw_of(0xFB04, 0x18), 0xE718FB04u); }

}  // namespace
}  // namespace infrared_test
