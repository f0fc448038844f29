#include "board/metal/driver/intel_pads.h"

#include <gtest/gtest.h>

#include <map>

namespace qduino::board::metal::intel_pads_test {
namespace {

constexpr std::uint64_t kAt = 0xfed0'c000;

/// Registers that are memory; a write or a read may be lost, as on Bay Trail.
struct Registers {
    std::map<std::uint64_t, std::uint32_t> words;
    int writes_to_lose = 0, reads_to_lose = 0;
};
Registers registers;

const MemoryAccess kMemory{.write =
                               [](std::uint64_t address, std::uint32_t value) {
                                   if (registers.writes_to_lose-- > 0) return;
                                   registers.words[address] = value;
                               },
                           .read =
                               [](std::uint64_t address) {
                                   if (registers.reads_to_lose-- > 0) return UINT32_MAX;
                                   return registers.words[address];
                               }};

class IntelPadsTest : public testing::Test {
  protected:
    void SetUp() override { registers = {}; }
};

// ---- Bay Trail: the registers of three pads, by hand from Linux's table -------------------------

constexpr std::uint64_t kPad0 = kAt + 85 * 16, kPad92 = kAt + 5 * 16, kPad101 = kAt + 100 * 16;

TEST_F(IntelPadsTest, BayTrailsPadsAreWhereTheTableHasThem) {
    BayTrailPads pads(kMemory, kAt);
    for (const auto& [pin, at] : {std::pair{0, kPad0}, {92, kPad92}, {101, kPad101}}) {
        const PinId id{static_cast<std::uint16_t>(pin)};
        registers.words[at] = 0x2003'cc07;  // another function, a pull, and what is not ours
        registers.words[at + 8] = 0x0000'0036;
        ASSERT_TRUE(pads.set_mode(id, PinMode::output, Level::high).ok());
        EXPECT_EQ(registers.words[at], pin == 92 ? 0x2003'c801u : 0x2003'c800u) << pin;
        EXPECT_EQ(registers.words[at + 8], 0x31u) << pin;  // level, both directions on
        pads.write(id, Level::low);
        EXPECT_EQ(registers.words[at + 8], 0x30u) << pin;
    }
    EXPECT_EQ(registers.words.size(), 6u);
}

TEST_F(IntelPadsTest, BayTrailsInputsHaveTheirPulls) {
    BayTrailPads pads(kMemory, kAt);
    registers.words[kPad0 + 8] = 6;
    for (const auto& [mode, setup] : {std::pair{PinMode::input, 0u},
                                      {PinMode::input_pullup, 0x480u},
                                      {PinMode::input_pulldown, 0x500u}}) {
        ASSERT_TRUE(pads.set_mode(PinId{0}, mode, Level::high).ok());
        EXPECT_EQ(registers.words[kPad0], setup);
        EXPECT_EQ(registers.words[kPad0 + 8], 2u);
    }
    EXPECT_EQ(pads.read(PinId{0}), Level::low);
    registers.words[kPad0 + 8] = 3;
    EXPECT_EQ(pads.read(PinId{0}), Level::high);
}

TEST_F(IntelPadsTest, BayTrailsLostAccessesAreRepeated) {
    BayTrailPads pads(kMemory, kAt);
    for (int lost = 1; lost <= 3; ++lost) {
        registers.words[kPad0 + 8] = 0;
        registers.writes_to_lose = lost;
        pads.write(PinId{0}, Level::high);
        EXPECT_EQ(registers.words[kPad0 + 8], 1u) << lost;
        registers.words[kPad0 + 8] = 0x10;
        registers.reads_to_lose = lost;
        registers.writes_to_lose = 0;
        pads.write(PinId{0}, Level::high);
        EXPECT_EQ(registers.words[kPad0 + 8], 0x11u) << lost;
    }
}

// ---- Apollo Lake --------------------------------------------------------------------------------

TEST_F(IntelPadsTest, ApolloLakesPadsFollowEachOther) {
    ApolloLakePads pads(kMemory, kAt, 47);
    registers.words[kAt + 0x500 + 8 * 46] = 0x4400'1702;      // another function, nothing on
    registers.words[kAt + 0x500 + 8 * 46 + 4] = 0x0003'3c7f;  // a pull
    ASSERT_TRUE(pads.set_mode(PinId{46}, PinMode::output, Level::high).ok());
    EXPECT_EQ(registers.words[kAt + 0x500 + 8 * 46], 0x4400'0003u);
    EXPECT_EQ(registers.words[kAt + 0x500 + 8 * 46 + 4], 0x0003'007fu);
    pads.write(PinId{46}, Level::low);
    EXPECT_EQ(registers.words[kAt + 0x500 + 8 * 46], 0x4400'0002u);
    EXPECT_EQ(pads.read(PinId{46}), Level::high);  // what is at the pad
    ASSERT_TRUE(pads.set_mode(PinId{46}, PinMode::input_pullup, Level::high).ok());
    EXPECT_EQ(registers.words[kAt + 0x500 + 8 * 46], 0x4400'0102u);
    EXPECT_EQ(registers.words[kAt + 0x500 + 8 * 46 + 4], 0x0003'307fu);
}

TEST_F(IntelPadsTest, WhatTheFirmwareKeepsIsRefused) {
    ApolloLakePads pads(kMemory, kAt, 78);
    registers.words[kAt + 0x20 + 4] = 1u << 8;       // pad 10 is another processor's
    registers.words[kAt + 0x60 + 2 * 8] = 1u << 13;  // pad 77 is locked
    const auto before = registers.words;
    for (const std::uint16_t pin : {10, 77})
        EXPECT_EQ(pads.set_mode(PinId{pin}, PinMode::output, Level::high).error().code,
                  ErrorCode::not_permitted);
    registers.words.erase(kAt + 0x20 + 9 * 4);
    registers.words.erase(kAt + 0x60 + 0);
    EXPECT_EQ(registers.words, before);
    EXPECT_TRUE(pads.set_mode(PinId{11}, PinMode::output, Level::high).ok());
}

TEST_F(IntelPadsTest, WhatThereIsNotIsRefused) {
    BayTrailPads bay(kMemory, kAt);
    ApolloLakePads apollo(kMemory, kAt, 43);
    for (PinPort* port : {static_cast<PinPort*>(&bay), static_cast<PinPort*>(&apollo)}) {
        const std::uint16_t behind = port == &bay ? 102 : 43;
        EXPECT_EQ(port->set_mode(PinId{behind}, PinMode::output, Level::high).error().code,
                  ErrorCode::not_found);
        EXPECT_EQ(port->set_mode(PinId{3}, PinMode::output_open_drain, Level::high).error().code,
                  ErrorCode::unsupported);
        port->write(PinId{behind}, Level::high);
        EXPECT_EQ(port->read(PinId{behind}), Level::low);
    }
    EXPECT_TRUE(registers.words.empty());
}

}  // namespace
}  // namespace qduino::board::metal::intel_pads_test
