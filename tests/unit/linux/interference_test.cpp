#include "board/linux/computer/interference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <string>
#include <vector>

#include "board/linux/computer/interference_memory.h"
#include "sched/admission.h"
#include "tests/unit/linux/fake_machine.h"

namespace qduino::board::linux::interference_test {
namespace {

using test::FakeMachine;
using Looks = std::vector<InterferenceLook>;

/// A gap in a spin.
struct Gap {
    Nanoseconds at{};
    Nanoseconds length{};
};

/// What a spin of 20 ms sees that has these gaps, in order.
InterferenceLook look_with(const std::vector<Gap>& gaps, std::int64_t others = 0) {
    InterferenceGaps seen;
    Nanoseconds now{};
    for (const Gap& gap : gaps) {
        for (; now + 1us < gap.at; now += 1us) seen.add(1us);
        seen.add(gap.at - now);
        seen.add(gap.length);
        now = gap.at + gap.length;
    }
    InterferenceLook look = seen.look();
    look.ticks = 5;
    look.others = others;
    return look;
}

/// A tick every 4 ms, of so many microseconds each.
std::vector<Gap> ticks(std::vector<int> us) {
    std::vector<Gap> gaps;
    for (const int each : us)
        gaps.push_back({1ms + 4ms * static_cast<int>(gaps.size()), std::chrono::microseconds{each}});
    return gaps;
}

std::vector<Gap> with(std::vector<Gap> gaps, Gap more) {
    gaps.push_back(more);
    std::ranges::sort(gaps, {}, &Gap::at);
    return gaps;
}

const InterferenceLook kQuiet = look_with(ticks({60, 60, 60, 60, 60}));
/// The host took the core away in the middle.
const InterferenceLook kStalled = look_with(with(ticks({60, 60, 60, 60}), {14ms, 6ms}));

Interference interference_of_looks(const Looks& looks, const InterferenceFigures& before = {}) {
    return interference_of(looks, {}, before);
}

TEST(InterferenceGaps, AreWithinBurstAndRateInEveryWindow) {
    const unsigned seed = std::random_device{}();
    std::mt19937 dice{seed};
    for (int round = 0; round < 40; ++round) {
        std::vector<Gap> gaps;
        Nanoseconds now{};
        while ((now += Nanoseconds{2'000 + dice() % 3'000'000}) < 20ms) {
            gaps.push_back({now, Nanoseconds{1'100 + dice() % (dice() % 5 == 0 ? 900'000 : 90'000)}});
            now += gaps.back().length;
        }
        const InterferenceLook look = look_with(gaps);
        for (std::size_t rate = 0; rate < kInterferenceRates.size(); ++rate) {
            double most = 0;
            for (std::size_t i = 0; i < gaps.size(); ++i) {
                double taken = 0;
                for (std::size_t j = i; j < gaps.size(); ++j) {
                    taken += static_cast<double>(gaps[j].length.count());
                    const auto window =
                        static_cast<double>((gaps[j].at + gaps[j].length - gaps[i].at).count());
                    most =
                        std::max(most, taken - window * static_cast<double>(kInterferenceRates[rate]) * 1e-6);
                }
            }
            EXPECT_NEAR(static_cast<double>(look.bursts[rate].count()), most, 3) << "seed " << seed;
        }
    }
}

TEST(Interference, IsCountedByItsShareOfTheCoreAndWhatComesAtOnce) {
    const Interference found = interference_of_looks(Looks(25, kQuiet));
    EXPECT_EQ(found.found_ppm, 15'000);  // 300 us of 20 ms
    EXPECT_EQ(found.counts.share_ppm, 25'000) << "a fifth above it, and the next rate";
    EXPECT_EQ(found.counts.peak_ppm, 63'000);
    const sched::PlatformInterferer counted = found.counted();
    EXPECT_GE(counted.interference(1us), 60us);
    EXPECT_LE(counted.interference(1us), 100us) << "one tick, a quarter more, and a step";
    EXPECT_GE(counted.interference(20ms), 300us);
    EXPECT_LE(counted.interference(10s), 2 * 500 * 300us);
    EXPECT_EQ(found.stalls, 0u);
}

TEST(Interference, AShortWindowIsNotCountedTheBurstOfALongOne) {
    // Eight in a row at 0.5 ms from each other, as for a burst of packets.
    std::vector<Gap> packets;
    for (int i = 0; i < 8; ++i) packets.push_back({3ms + i * 500us, 100us});
    const Interference found = interference_of_looks(Looks(25, look_with(packets)));
    const sched::PlatformInterferer counted = found.counted();
    EXPECT_GE(counted.interference(4ms), 800us);
    EXPECT_LE(counted.interference(100us), 600us);
    sched::PlatformInterferer long_run = counted;
    long_run.peak_interval = Nanoseconds{0};
    EXPECT_GT(long_run.interference(100us), 600us) << "what the share alone would say";
}

TEST(Interference, AStallOfTheHostIsSaidByThisNameAndNotCounted) {
    Looks looks(24, kQuiet);
    looks.push_back(kStalled);
    const Interference found = interference_of_looks(looks);
    EXPECT_EQ(found.counts, interference_of_looks(Looks(25, kQuiet)).counts);
    EXPECT_EQ(found.worst, 6ms);
    EXPECT_EQ(found.stalls, 1u);
    EXPECT_EQ(found.looks, 25u);
}

TEST(Interference, WhatMoreThanATenthOfTheLooksHaveIsCounted) {
    const InterferenceLook busy = look_with(with(ticks({60, 60, 60, 60, 60}), {7ms, 700us}));
    Looks looks(20, kQuiet);
    looks.insert(looks.end(), 5, busy);
    EXPECT_GE(interference_of_looks(looks).counted().interference(1us), 690us);
}

TEST(Interference, CountsWhatItCountedUntilTheLooksRefuteIt) {
    const InterferenceFigures before = interference_of_looks(Looks(100, kQuiet)).counts;
    const auto counted_with = [&](std::size_t of_100, const InterferenceLook& others) {
        Looks looks(100 - of_100, kQuiet);
        looks.insert(looks.end(), of_100, others);
        return interference_of_looks(looks, before).counts;
    };
    const InterferenceLook longer = look_with(ticks({60, 60, 200, 60, 60}));
    EXPECT_EQ(counted_with(16, longer), before) << "ten of a hundred, and six by chance";
    EXPECT_GT(counted_with(18, longer).peak_burst, before.peak_burst);
    // As much, in pieces of a tenth.
    const InterferenceLook whole = look_with({{9ms, 300us}});
    std::vector<Gap> gaps;
    for (int i = 0; i < 10; ++i) gaps.push_back({1ms + i * 2ms, 30us});
    const InterferenceLook pieces = look_with(gaps);
    const InterferenceFigures long_ones = interference_of_looks(Looks(100, whole)).counts;
    const auto counted_without = [&](std::size_t of_100) {
        Looks looks(100 - of_100, whole);
        looks.insert(looks.end(), of_100, pieces);
        return interference_of_looks(looks, long_ones).counts;
    };
    EXPECT_EQ(counted_without(97), long_ones) << "three of a hundred, for ten less six and one by chance";
    EXPECT_EQ(counted_without(98).share_ppm, long_ones.share_ppm);
    EXPECT_LT(counted_without(98).peak_burst, long_ones.peak_burst / 2);
}

TEST(Interference, TheShareFollowsTheMean) {
    const InterferenceFigures before = interference_of_looks(Looks(25, kQuiet)).counts;
    EXPECT_EQ(
        interference_of_looks(Looks(25, look_with(ticks({98, 98, 98, 98, 98}))), before).counts.share_ppm,
        25'000);
    EXPECT_EQ(interference_of_looks(Looks(25, look_with(ticks({104, 104, 104, 104, 104}))), before)
                  .counts.share_ppm,
              40'000)
        << "more than is counted";
    EXPECT_EQ(
        interference_of_looks(Looks(25, look_with(ticks({45, 45, 45, 45, 45}))), before).counts.share_ppm,
        16'000)
        << "less than half of it";
}

TEST(Interference, ASilentCoreCountsNothing) {
    const Interference silent = interference_of_looks(Looks(25));
    EXPECT_TRUE(silent.measured);
    EXPECT_EQ(silent.counted().interference(10s), Nanoseconds{0});
    EXPECT_FALSE(interference_of_looks({}).measured);
    EXPECT_EQ(Interference{}.counted().interference(10s), Nanoseconds{0});
}

TEST(Interference, OfARunIsWhatItsInterruptsWouldHaveTaken) {
    Looks looks(10, kQuiet);
    looks.insert(looks.end(), 10, look_with(ticks({90, 90, 90, 90, 90}), 80));
    const Interference known = interference_of_looks(looks);
    const auto look = look_of_run(known, 10s, 40'000);
    ASSERT_TRUE(look);
    EXPECT_EQ(look->others, 80);
    EXPECT_EQ(look->ticks, 5);
    EXPECT_EQ(look->taken, 85 * known.each);
    EXPECT_FALSE(look_of_run({}, 10s, 1)) << "nobody knows how long an interrupt is";
}

// ---- ten starts on the development machine, as it was seen --------------------------------------

/// A virtual machine: 250 ticks a second of 45 to 230 us each, an interrupt of the host besides in
/// every sixth look, and what else comes.
class Host {
  public:
    explicit Host(unsigned seed) : dice_{seed} {}
    InterferenceLook look() {
        std::vector<int> lengths;
        for (int i = 0; i < 5; ++i) lengths.push_back(45 + static_cast<int>(dice_() % 60));
        if (dice_() % 4 == 0) lengths[dice_() % 5] = 120 + static_cast<int>(dice_() % 110);
        std::vector<Gap> gaps = ticks(lengths);
        if (dice_() % 6 == 0) gaps = with(gaps, {2500us + 4ms * (dice_() % 4), 60us});
        return look_with(gaps);
    }
    Looks looks(int count) {
        Looks seen;
        for (int i = 0; i < count; ++i) seen.push_back(look());
        return seen;
    }

  private:
    std::mt19937 dice_;
};

/// R of each loop, highest first; empty: refused.
std::vector<Nanoseconds> responses(std::vector<sched::Vcpu> loops, const Interference& known) {
    sched::CoreLoad load;
    for (const sched::Vcpu& loop : loops) load.mains.push_back(loop);
    load.overheads.release_cost = 12us;
    load.overheads.enforcement_cost = 6us;
    load.overheads.kept_budget = 50ms;
    load.overheads.kept_period = 1s;
    load.overheads.add(known.counted());
    const sched::Admission admission = sched::admit(load);
    if (!admission.admitted) return {};
    std::vector<Nanoseconds> found;
    for (const sched::LoopResponse& each : admission.loops) found.push_back(each.response);
    return found;
}

TEST(Interference, TenStartsGiveOneVerdictThoughTheHostStallsInTwo) {
    const std::vector<std::vector<sched::Vcpu>> sketches{
        {{1, 1ms, 10ms}, {2, 10ms, 50ms}, {3, 20ms, 100ms}},     // U = 0.50
        {{1, 1500us, 10ms}, {2, 14ms, 50ms}, {3, 20ms, 100ms}},  // U = 0.63
        {{1, 2ms, 10ms}, {2, 15ms, 50ms}, {3, 20ms, 100ms}},     // U = 0.70
        {{1, 200us, 1ms}, {2, 600us, 2ms}}};                     // U = 0.50, of short periods
    for (unsigned seed = 1; seed <= 10; ++seed) {
        Host host{seed};
        InterferenceMemory memory;
        std::vector<std::vector<Nanoseconds>> first;
        for (int start = 1; start <= 10; ++start) {
            Looks seen = host.looks(start == 1 ? 25 : 5);
            if (start == 4) seen[2] = look_with(with(ticks({70, 80, 60, 90, 70}), {6ms, 338us}));
            if (start == 8) seen[1] = look_with(with(ticks({70, 80, 60, 90, 70}), {6ms, 928us}));
            memory.add(seen);
            memory = InterferenceMemory::parse(memory.text());
            const Interference known = memory.interference();
            for (std::size_t i = 0; i < sketches.size(); ++i) {
                const std::vector<Nanoseconds> found = responses(sketches[i], known);
                ASSERT_FALSE(found.empty())
                    << "sketch " << i << " refused, start " << start << ", seed " << seed;
                if (start == 1) first.push_back(found);
                for (std::size_t k = 0; k < found.size(); ++k) {
                    EXPECT_LE(found[k], first[i][k] + first[i][k] / 10)
                        << "start " << start << " seed " << seed;
                    EXPECT_GE(found[k], first[i][k] - first[i][k] / 10)
                        << "start " << start << " seed " << seed;
                }
            }
            if (start == 8) {
                EXPECT_GE(known.stalls, 1u) << "and it is said";
                EXPECT_EQ(known.worst, 928us);
            }
            EXPECT_LE(known.counts.share_ppm, 2 * known.found_ppm);
        }
    }
}

// ---- the memory ---------------------------------------------------------------------------------

TEST(InterferenceMemory, IsTheSameFromStartToStart) {
    FakeMachine machine;
    InterferenceMemory first;
    Host host{7};
    first.add(host.looks(25));
    const Interference told = first.interference();
    ASSERT_TRUE(first.write(0, machine.root()));
    InterferenceMemory second = InterferenceMemory::read(0, machine.root());
    EXPECT_EQ(second.size(), 25u);
    EXPECT_EQ(second.text(), first.text());
    second.add(host.looks(5));
    EXPECT_EQ(second.interference().counts, told.counts);
    EXPECT_EQ(InterferenceMemory::read(1, machine.root()).size(), 0u) << "of another core";
}

TEST(InterferenceMemory, OldLooksGoAndRunsPushNoneOut) {
    InterferenceMemory memory;
    memory.add(Looks(InterferenceMemory::kLooks, kStalled));
    memory.add(Looks(InterferenceMemory::kLooks, kQuiet));
    EXPECT_EQ(memory.size(), InterferenceMemory::kLooks);
    EXPECT_EQ(memory.interference().found_ppm, 15'000);
    InterferenceLook run;
    run.taken = 1ms;
    memory.add_run(run, 1000);
    EXPECT_EQ(memory.size(), InterferenceMemory::kLooks);
    // A hundred looks of 300 us and forty of a run of 1 ms, without the worst seven.
    EXPECT_EQ(memory.interference().found_ppm, (100 * 300 + 33 * 1000) * 1'000'000LL / (133 * 20'000));
}

/// A look's line: taken, worst, ticks, others, and the burst of each rate.
std::string line_of_look(const std::string& first, int rates = static_cast<int>(kInterferenceRates.size())) {
    std::string line = "look 9 8 7 " + first;
    for (int i = 1; i <= rates; ++i) line += ' ' + std::to_string(i);
    return line + '\n';
}

TEST(InterferenceMemory, LeavesOutWhatIsMalformed) {
    for (const std::string& line :
         {line_of_look("-6"), line_of_look("x"), line_of_look("6", 14), line_of_look("6", 16),
          line_of_look("99999999999"), std::string{"look\n"}, std::string{"run 1 2\n"}, std::string{"\n"}})
        EXPECT_EQ(InterferenceMemory::parse(line).text(), "counts 0 0 0 0\n") << line;
    const std::string whole = "counts 1 2 3 4\n" + line_of_look("6") + "run 1 2 3\n";
    const InterferenceMemory read = InterferenceMemory::parse(whole);
    EXPECT_EQ(read.size(), 1u);
    EXPECT_EQ(read.text(), whole);
}

TEST(InterferenceMemory, FiguresMayBeSaidInstead) {
    const auto said = InterferenceMemory::figures_said("15000 75000 100000 90000");
    ASSERT_TRUE(said);
    EXPECT_EQ(*said, (InterferenceFigures{15'000, 75us, 100'000, 90us}));
    for (const char* text : {"", "1 2 3", "1 2 3 4 5", "1 2 3 -4", "1 2 3 4us"})
        EXPECT_FALSE(InterferenceMemory::figures_said(text)) << text;
}

TEST(InterferenceMemory, BelievesNoFileOfAStranger) {
    FakeMachine machine;
    machine.put("/elsewhere", line_of_look("6"));
    const std::string path = machine.path("/run/qduino/qduino-interrupts.0");
    std::filesystem::create_directories(machine.path("/run/qduino"));
    std::filesystem::create_symlink(machine.path("/elsewhere"), path);
    EXPECT_EQ(InterferenceMemory::read(0, machine.root()).size(), 0u);
}

TEST(Interference, OfThisComputerIsFoundOrSaidNotToBe) {
    const Looks found = look_for_interference(0, 10, 2);
    if (found.empty()) GTEST_SKIP() << "no SCHED_FIFO here";
    EXPECT_GE(found.size(), 2u);
    EXPECT_LE(found.size(), 6u);
    EXPECT_GE(found[0].taken, found[0].worst);
    EXPECT_TRUE(look_for_interference(100'000, 10, 1).empty()) << "there is no such core";
}

}  // namespace
}  // namespace qduino::board::linux::interference_test
