// A board that has nothing but what every board must have: each capability that it lacks answers
// `unsupported`, or does nothing.
#include <gtest/gtest.h>

#include <array>

#include "board/board.h"
#include "tests/unit/board/bare_board.h"

namespace qduino::board::capability_test {
namespace {

/// The code of the answer; a success is no answer here.
template <typename Answer>
ErrorCode refusal(const Answer& answer) {
    return answer.ok() ? ErrorCode::internal : answer.error().code;
}

TEST(BoardCapabilities, WhatABoardLacksIsUnsupported) {
    test::BareBoard bare;
    Board& board = bare;
    std::array<std::uint8_t, 2> bytes{};
    EXPECT_EQ(refusal(board.pwm_write(PinId{1}, 0.5)), ErrorCode::unsupported);
    EXPECT_EQ(refusal(board.pwm_period(PinId{1}, 20ms)), ErrorCode::unsupported);
    EXPECT_EQ(refusal(board.analog_read(PinId{1})), ErrorCode::unsupported);
    EXPECT_EQ(refusal(board.chip_temperature()), ErrorCode::unsupported);
    EXPECT_EQ(refusal(board.attach_edge(
                  PinId{1}, Edge::both, [](void*) {}, nullptr, 33)),
              ErrorCode::unsupported);
    board.detach_edge(PinId{1});
    board.pins_write(std::array{PinId{1}, PinId{2}}, Level::high);  // one after the other
    EXPECT_TRUE(board.pin_read(PinId{1}) == Level::high && board.pin_read(PinId{2}) == Level::high);
    EXPECT_EQ(refusal(board.i2c_transfer({1}, {0x48}, bytes, bytes)), ErrorCode::unsupported);
    EXPECT_EQ(refusal(board.spi_transfer({0}, {}, bytes)), ErrorCode::unsupported);
    EXPECT_EQ(refusal(board.serve_interrupts(DeviceClass::nic, 33)), ErrorCode::unsupported);
    EXPECT_EQ(refusal(board.change_io(33, {1ms, 10ms})), ErrorCode::unsupported);
    EXPECT_EQ(refusal(board.route_interrupts(DeviceClass::nic, 0, false)), ErrorCode::unsupported);
    EXPECT_EQ(refusal(board.core_timer(0, false)), ErrorCode::unsupported);
    EXPECT_EQ(board.platform_overheads(0).release_cost, Nanoseconds{0});
    board.note_overrun(1us);
    board.note_setup(true);
    board.note_progress();
    board.promise_progress(1, 1s);
}

}  // namespace
}  // namespace qduino::board::capability_test
