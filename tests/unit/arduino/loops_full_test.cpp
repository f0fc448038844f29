// As many loops as there can be, and one more.
#include <Arduino.h>
#include <gtest/gtest.h>

#include "runtime/sketch.h"

#define QDUINO_TEST_LOOP(n) \
    void loop(n, 1, 100) {}
// clang-format off
QDUINO_TEST_LOOP(1) QDUINO_TEST_LOOP(2) QDUINO_TEST_LOOP(3) QDUINO_TEST_LOOP(4) QDUINO_TEST_LOOP(5) QDUINO_TEST_LOOP(6) QDUINO_TEST_LOOP(7) QDUINO_TEST_LOOP(8)
QDUINO_TEST_LOOP(9) QDUINO_TEST_LOOP(10) QDUINO_TEST_LOOP(11) QDUINO_TEST_LOOP(12) QDUINO_TEST_LOOP(13) QDUINO_TEST_LOOP(14) QDUINO_TEST_LOOP(15) QDUINO_TEST_LOOP(16)
QDUINO_TEST_LOOP(17) QDUINO_TEST_LOOP(18) QDUINO_TEST_LOOP(19) QDUINO_TEST_LOOP(20) QDUINO_TEST_LOOP(21) QDUINO_TEST_LOOP(22) QDUINO_TEST_LOOP(23) QDUINO_TEST_LOOP(24)
QDUINO_TEST_LOOP(25) QDUINO_TEST_LOOP(26) QDUINO_TEST_LOOP(27) QDUINO_TEST_LOOP(28) QDUINO_TEST_LOOP(29) QDUINO_TEST_LOOP(30) QDUINO_TEST_LOOP(31) QDUINO_TEST_LOOP(32)
    // clang-format on

    TEST(ArduinoLoopsFull, ThirtyTwoLoopsAndTheNextIsCounted) {
    auto& table = qduino::runtime::sketch_table();
    ASSERT_EQ(table.loops.size(), 32U);
    EXPECT_EQ(table.dropped, 0);
    for (std::size_t i = 0; i < 32; ++i) EXPECT_EQ(table.loops[i].id, i + 1);
    const qduino::arduino::LoopRegistration one_more(
        5, 1ms, 10ms, 0, 0ms, 0, [] {}, __FILE__, __LINE__);
    EXPECT_EQ(table.loops.size(), 32U);
    EXPECT_EQ(table.dropped, 1) << "the runtime refuses the sketch for it";
}
