// What is said of a pin.
#include "report/pin/pin_story.h"

#include <gtest/gtest.h>

namespace qduino::apps::pin_story_test {
namespace {

std::string said(const PinStory& story) { return story.sentence(kEpoch); }

TEST(PinStory, RegularPulsesHaveAPeriodAndItsDeviation) {
    PinStory story;
    story.level(kEpoch, false);
    Instant now = kEpoch;
    for (const Nanoseconds period : std::initializer_list<Nanoseconds>{500ms, 500ms, 500ms + 3us, 500ms}) {
        story.level(now, true);
        story.level(now + 100ms, false);
        now += period;
    }
    story.level(now, true);
    EXPECT_EQ(said(story), "4 pulses, period 500.001 ms ± 2.25 us, each 100.000 ms, high at the end");
    story.level(now + 7ms, false);
    EXPECT_EQ(said(story), "5 pulses, period 500.001 ms ± 2.25 us, each 100.000 ms")
        << "the last pulse may have been cut";
}

TEST(PinStory, IrregularOnesHaveTheirBounds) {
    PinStory story;
    Instant now = kEpoch;
    for (const Nanoseconds width : std::initializer_list<Nanoseconds>{1ms, 20ms, 3ms, 5ms}) {
        story.level(now, true);
        story.level(now + width, false);
        now += width + 10ms;
    }
    EXPECT_EQ(said(story), "4 pulses, period 11 ms … 30 ms, each 1 ms … 20 ms");
}

TEST(PinStory, AWriteOfTheSameLevelIsNoChange) {
    PinStory story;
    for (int i = 0; i < 5; ++i) story.level(kEpoch + i * 1ms, false);
    EXPECT_EQ(said(story), "low all the time");
    story.level(kEpoch + 2s, true);
    story.level(kEpoch + 3s, true);
    EXPECT_EQ(said(story), "high from 2000.000 ms on");
    story.level(kEpoch + 4s, false);
    EXPECT_EQ(said(story), "1 pulse of 2000.000 ms, at 2000.000 ms");
}

TEST(PinStory, PwmAndServosAreToldByTheirDuty) {
    PinStory led, servo;
    led.duty(kEpoch, 0);
    led.duty(kEpoch + 1s, 1);
    led.duty(kEpoch + 2s, 0);
    EXPECT_EQ(said(led), "1 pulse of 1000.000 ms, at 1000.000 ms") << "its ends are levels";
    led.duty(kEpoch + 3s, 0.5);
    EXPECT_EQ(said(led), "PWM, duty 0.0 % … 100.0 %, changed 3 times");
    servo.pwm_period(20ms);
    servo.duty(kEpoch, 0.075);
    EXPECT_EQ(said(servo), "PWM of 20.000 ms, duty 7.5 % (1.5 ms)");
}

TEST(PinStory, ToneAndMelodyAreToldByTheirFrequency) {
    PinStory story;
    Instant now = kEpoch;
    const auto play = [&](Nanoseconds half, int pulses) {
        for (int i = 0; i < pulses; ++i, now += 2 * half) {
            story.level(now, true);
            story.level(now + half, false);
        }
    };
    play(1ms, 100);
    EXPECT_EQ(said(story), "100 pulses, a tone of 500.0 Hz");
    now += 1s;
    play(500us, 100);
    EXPECT_EQ(said(story), "200 pulses, tones of 500.0 Hz … 1000 Hz");
}

TEST(PinStory, AnInputIsNoLevel) {
    PinStory story;
    EXPECT_FALSE(story.told());
    story.level(kEpoch, true);
    story.released(kEpoch + 1s);
    EXPECT_EQ(said(story), "1 pulse of 1000.000 ms, at 0 ns");
}

}  // namespace
}  // namespace qduino::apps::pin_story_test
