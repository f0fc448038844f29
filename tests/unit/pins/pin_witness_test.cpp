// What the witness keeps of random writes is what a naive list of them says.
#include "report/pin/pin_witness.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace qduino::apps::pin_witness_test {
namespace {

using board::Level;
using board::PinId;

struct Write {
    Instant at;
    std::uint16_t pin;
    bool high;
};

std::vector<Write> random_writes(unsigned seed) {
    std::mt19937 random{seed};
    std::vector<Write> writes;
    Instant now = kEpoch;
    for (int i = 0; i < 2000; ++i) {
        now += Nanoseconds{random() % 4 == 0 ? 0 : random() % 1'000'000};
        writes.push_back({now, static_cast<std::uint16_t>(random() % 5 * 31), random() % 2 == 0});
    }
    return writes;
}

/// What was written last to `pin`, up to and including the instant `at`.
std::optional<bool> level_at(const std::vector<Write>& writes, std::uint16_t pin, Instant at) {
    std::optional<bool> level;
    for (const Write& write : writes) {
        if (write.at <= at && write.pin == pin) level = write.high;
    }
    return level;
}

class Random : public testing::TestWithParam<unsigned> {};

TEST_P(Random, RowsShowTheLevelsOfEachInstant) {
    const std::vector<Write> writes = random_writes(GetParam());
    const Instant end = writes.back().at + 1ms;
    board::NoPeripherals nothing;
    PinWitness witness{kEpoch};
    witness.forward_to(nothing);
    picture::Schedule schedule;
    schedule.from = kEpoch + 100ms;
    schedule.until = kEpoch + 300ms;
    witness.rows_from(schedule.from - kEpoch);
    for (const Write& write : writes)
        witness.pin_written(write.at, PinId{write.pin}, write.high ? Level::high : Level::low);
    witness.end(end);
    witness.pin_written(end + 1s, PinId{3}, Level::high);  // what comes now is not seen
    witness.add_rows(schedule, kEpoch, false);
    ASSERT_EQ(schedule.pins.size(), 5u);
    EXPECT_EQ(schedule.pins_until, schedule.until);
    std::mt19937 random{GetParam()};
    for (std::size_t i = 0; i < schedule.pins.size(); ++i) {
        const auto pin = static_cast<std::uint16_t>(i * 31);
        EXPECT_EQ(schedule.pins[i].name, "pin " + std::to_string(pin));
        for (int probe = 0; probe < 200; ++probe) {
            const Instant at = schedule.from + Nanoseconds{random() % 200'000'000};
            std::optional<bool> shown;
            for (const picture::PinStretch& stretch : schedule.pins[i].stretches) {
                if (stretch.from <= at && at < stretch.until) shown = stretch.height > 0.5F;
            }
            EXPECT_EQ(shown, level_at(writes, pin, at)) << "seed " << GetParam() << ", pin " << pin;
        }
    }
}

TEST_P(Random, TheSentencesCountTheirPulses) {
    const std::vector<Write> writes = random_writes(GetParam());
    board::NoPeripherals nothing;
    PinWitness witness{kEpoch};
    witness.forward_to(nothing);
    std::map<std::uint16_t, int> pulses;
    std::map<std::uint16_t, bool> high;
    for (const Write& write : writes) {
        witness.pin_written(write.at, PinId{write.pin}, write.high ? Level::high : Level::low);
        if (high[write.pin] && !write.high) ++pulses[write.pin];
        high[write.pin] = write.high;
    }
    witness.end(writes.back().at + 1ms);
    for (const auto& [pin, count] : pulses) {
        const std::string line = "pin " + std::to_string(pin) + ": " + std::to_string(count) + " pulses, ";
        EXPECT_NE(witness.sentences().find(line), std::string::npos) << line << "\n" << witness.sentences();
    }
}
INSTANTIATE_TEST_SUITE_P(Seeds, Random, testing::Range(0u, 8u));

TEST(PinWitness, ASlowPinGetsALongerWindowAndTheRunBoundsIt) {
    board::NoPeripherals nothing;
    PinWitness witness{kEpoch};
    witness.forward_to(nothing);
    for (int i = 0; i < 20; ++i)
        witness.pin_written(kEpoch + i * 500ms, PinId{13}, i % 2 == 0 ? Level::high : Level::low);
    witness.end(kEpoch + 10s);
    picture::Schedule schedule;
    schedule.from = kEpoch;
    schedule.until = kEpoch + 200ms;
    witness.add_rows(schedule, kEpoch, true);
    EXPECT_EQ(schedule.pins_until, kEpoch + 3s);
    schedule.pins.clear();
    schedule.from = kEpoch + 9s;
    schedule.until = kEpoch + 9200ms;
    witness.add_rows(schedule, kEpoch, true);
    EXPECT_EQ(schedule.pins_until, kEpoch + 10s);
}

}  // namespace
}  // namespace qduino::apps::pin_witness_test
