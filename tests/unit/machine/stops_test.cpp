#include "printer/machine/stops.h"

#include <gtest/gtest.h>

namespace qduino::printer::machine::stops_test {
namespace {

TEST(Stops, EachAskIsANewNumberForLoop2) {
    std::atomic<std::uint32_t> emergency{0};
    Stops stops(emergency);
    const std::uint32_t served = stops.stop_asked();
    EXPECT_FALSE(stops.running());
    stops.ask();
    EXPECT_NE(stops.stop_asked(), served);
    EXPECT_TRUE(stops.running());
    stops.finished();
    EXPECT_FALSE(stops.running());
    EXPECT_NE(stops.stop_asked(), served) << "loop 2 is asked whether or not loop 1 has finished";
}

TEST(Stops, AnEmergencyReachesLoop2WithoutLoop1) {
    std::atomic<std::uint32_t> emergency{7};
    Stops stops(emergency);
    EXPECT_FALSE(stops.emergency_pending()) << "an old one, of a run before";
    const std::uint32_t served = stops.stop_asked();
    emergency = 8;
    EXPECT_NE(stops.stop_asked(), served);
    EXPECT_TRUE(stops.emergency_pending());
    EXPECT_FALSE(stops.running()) << "loop 1 has asked for nothing";
    stops.take_emergency();
    EXPECT_FALSE(stops.emergency_pending());
}

TEST(Stops, AnEmergencyInTheMiddleOfAReleaseIsSeenByLoop2AtOnceAndByLoop1InItsNext) {
    std::atomic<std::uint32_t> emergency{0};
    Stops stops(emergency);
    const std::uint32_t served = stops.stop_asked();
    stops.observe();
    emergency = 1;
    EXPECT_NE(stops.stop_asked(), served);
    EXPECT_EQ(stops.asked_as_seen(), served);
    stops.observe();
    EXPECT_EQ(stops.asked_as_seen(), stops.stop_asked());
}

}  // namespace
}  // namespace qduino::printer::machine::stops_test
