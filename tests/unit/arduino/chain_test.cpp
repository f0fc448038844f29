// A chain as a sketch writes it, and what it declares.
#include "arduino/core/chain.h"

#include <gtest/gtest.h>

#include <string>

#include "arduino/core/channels.h"

namespace qduino::arduino::chain_test {
namespace {

/// What the only chain declares.
runtime::Chain declared() {
    runtime::Chain found;
    runtime::ChainDeclaration::take_each([&](const runtime::Chain& chain) { found = chain; });
    return found;
}

std::string wrong(const runtime::Chain& chain) { return chain.wrong ? chain.wrong : ""; }

TEST(ArduinoChain, LoopsRingsAndLimits) {
    RingBuffer<int, 4> ring;
    Channel<int> channel;
    ::Chain chain{"stop"};
    EXPECT_FALSE(declared().is_declared());
    chain.from(2)
        .through(1)
        .over(ring)
        .through(3)
        .over(channel)
        .through(2, std::chrono::milliseconds{1})
        .to("heater");
    chain.reactsWithin(20).freshWithin(std::chrono::microseconds{1500});
    const runtime::Chain is = declared();
    EXPECT_EQ(is.name, "stop");
    EXPECT_EQ(is.source, runtime::Chain::Source::read);
    EXPECT_EQ(is.from, "pin 2");
    EXPECT_EQ(is.to, "heater");
    ASSERT_EQ(is.stages.size(), 3u);
    EXPECT_EQ(is.stages[0].vcpu, 1);
    EXPECT_FALSE(is.stages[0].queued);
    EXPECT_EQ(is.stages[1].vcpu, 3);
    EXPECT_TRUE(is.stages[1].queued);
    EXPECT_EQ(is.stages[2].pass, 1ms);
    EXPECT_FALSE(is.stages[2].queued);
    EXPECT_EQ(is.limits.reaction, 20ms);
    EXPECT_EQ(is.limits.age, 1500us);
    EXPECT_EQ(wrong(is), "");
}

TEST(ArduinoChain, EdgesAndDevices) {
    {
        ::Chain edge{"edge"};
        edge.fromEdge(7).to(9);
        const runtime::Chain is = declared();
        EXPECT_EQ(is.source, runtime::Chain::Source::edge);
        EXPECT_EQ(is.pin.number, 7);
        EXPECT_EQ(is.to, "pin 9");
    }
    ::Chain device{"device"};
    device.fromDevice("uart");
    EXPECT_EQ(declared().device, board::DeviceClass::uart);
}

TEST(ArduinoChain, TheFirstMistakeIsSaid) {
    const auto mistake = [](auto declare) {
        ::Chain chain{"chain"};
        declare(chain);
        return wrong(declared());
    };
    EXPECT_EQ(mistake([](::Chain& c) { c.from(128).from(1); }), "a pin is 0 to 127");
    EXPECT_EQ(mistake([](::Chain& c) { c.from(1).fromEdge(2); }), "it begins twice");
    EXPECT_EQ(mistake([](::Chain& c) { c.to(1).to(2); }), "it ends twice");
    EXPECT_EQ(mistake([](::Chain& c) { c.to(-1); }), "a pin is 0 to 127");
    EXPECT_EQ(mistake([](::Chain& c) { c.through(33); }), "a loop's number is 1 to 32");
    EXPECT_EQ(mistake([](::Chain& c) { c.through(1, -1); }), "a pass cannot last less than nothing");
    EXPECT_EQ(mistake([](::Chain& c) { c.reactsWithin(0); }), "a limit is more than 0");
    EXPECT_EQ(mistake([](::Chain& c) { c.fromDevice("modem"); }),
              "no such device: gpio, i2c, spi, uart, nic, disk");
    EXPECT_EQ(mistake([](::Chain& c) {
                  for (int i = 0; i < 9; ++i) c.through(1);
              }),
              "more than 8 stages");
}

}  // namespace
}  // namespace qduino::arduino::chain_test
