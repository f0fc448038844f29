// Pins before there is a board: what random calls leave is what the last call of each kind says.
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <random>
#include <vector>

#include "board/early_pins.h"
#include "tests/fake/fake_board.h"

namespace qduino::board::early_pins_test {
namespace {

constexpr std::array kModes = {PinMode::input, PinMode::input_pullup, PinMode::output};
constexpr int kPins = 4;

struct Call {
    enum Kind { mode, write, pwm } kind;
    std::uint16_t pin;
    int value;  ///< an index of kModes, a level, or a duty in per cent
};

/// The last of the calls of `kind` for `pin`; null: none. A write ends a PWM.
const Call* last(const std::vector<Call>& calls, Call::Kind kind, std::uint16_t pin) {
    const Call* found = nullptr;
    for (const Call& call : calls) {
        if (call.kind == Call::write && kind == Call::pwm && call.pin == pin) found = nullptr;
        if (call.kind == kind && call.pin == pin) found = &call;
    }
    return found;
}

void make(EarlyPins& pins, const Call& call) {
    const PinId pin{call.pin};
    if (call.kind == Call::mode) {
        EXPECT_TRUE(pins.mode(pin, kModes[static_cast<std::size_t>(call.value)]).ok());
    } else if (call.kind == Call::pwm) {
        EXPECT_TRUE(pins.pwm(pin, call.value / 100.0).ok());
    } else {
        pins.write(pin, call.value ? Level::high : Level::low);
    }
}

int refusals = 0;
void count_refusal(PinId, const Error&) { ++refusals; }

TEST(EarlyPins, WhatHoldsInTheEndIsDoneOnTheBoard) {
    const auto seed = std::random_device{}();
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    for (int round = 0; round < 200; ++round) {
        std::vector<Call> calls(random() % 12);
        EarlyPins pins;
        for (Call& call : calls) {
            call = {Call::Kind(random() % 3), static_cast<std::uint16_t>(random() % kPins), 0};
            call.value = static_cast<int>(random() % (call.kind == Call::mode    ? 3
                                                      : call.kind == Call::write ? 2
                                                                                 : 101));
            make(pins, call);
        }
        fake::FakeBoard board;
        pins.hand_over(board, &count_refusal);
        std::map<int, PinMode> modes;
        std::vector<std::pair<int, int>> levels;
        std::map<int, double> duties;
        for (std::uint16_t pin = 0; pin < kPins; ++pin) {
            if (const Call* call = last(calls, Call::mode, pin))
                modes[pin] = kModes[static_cast<std::size_t>(call->value)];
            if (const Call* call = last(calls, Call::write, pin)) levels.emplace_back(pin, call->value);
            if (const Call* call = last(calls, Call::pwm, pin)) duties[pin] = call->value / 100.0;
        }
        EXPECT_EQ(board.state.modes, modes);
        std::vector<std::pair<int, int>> written;
        for (const fake::PinEvent& event : board.state.writes) written.emplace_back(event.pin, event.level);
        EXPECT_EQ(written, levels);
        std::map<int, double> given;
        for (const fake::PwmEvent& event : board.state.pwm) given[event.pin] = event.duty;
        EXPECT_EQ(given, duties);
    }
    EXPECT_EQ(refusals, 0);
}

TEST(EarlyPins, TheyAreHandedOverOnceAndReadAsOnAnArduino) {
    EarlyPins pins;
    EXPECT_TRUE(pins.mode(PinId{3}, PinMode::output).ok());
    EXPECT_EQ(pins.read(PinId{3}), Level::low);
    pins.write(PinId{3}, Level::high);
    EXPECT_EQ(pins.read(PinId{3}), Level::high);
    EXPECT_TRUE(pins.mode(PinId{4}, PinMode::input_pullup).ok());
    EXPECT_EQ(pins.read(PinId{4}), Level::high);
    EXPECT_EQ(pins.read(PinId{5}), Level::low);
    EXPECT_FALSE(pins.mode(PinId{kPinCount}, PinMode::output).ok());
    EXPECT_FALSE(pins.pwm(PinId{kPinCount}, 0.5).ok());
    fake::FakeBoard first, second;
    pins.hand_over(first, &count_refusal);
    pins.hand_over(second, &count_refusal);
    EXPECT_EQ(first.state.modes.size(), 2U);
    EXPECT_TRUE(second.state.modes.empty());
}

TEST(EarlyPins, ARefusedPinIsTold) {
    EarlyPins pins;
    EXPECT_TRUE(pins.pwm(PinId{5}, 0.25).ok());
    fake::FakeBoard board;
    board.state.refuse_everything = true;
    refusals = 0;
    pins.hand_over(board, &count_refusal);
    EXPECT_EQ(refusals, 1);
    refusals = 0;
}

}  // namespace
}  // namespace qduino::board::early_pins_test
