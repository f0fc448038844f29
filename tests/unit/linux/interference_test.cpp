#include "board/linux/computer/interference.h"

#include <gtest/gtest.h>

#include "board/linux/computer/interference_memory.h"
#include "tests/unit/linux/fake_machine.h"

namespace qduino::board::linux::interference_test {
namespace {

using test::FakeMachine;
using Looks = std::vector<InterferenceLook>;

/// A tick of 60 us every 4 ms.
constexpr InterferenceLook kQuiet{
    .taken = 300us, .usual = 60us, .longest = 61us, .worst = 62us, .ticks = 5, .others = 0};
/// The host took the core away in the middle.
constexpr InterferenceLook kStalled{
    .taken = 9ms, .usual = 8ms, .longest = 700us, .worst = 8ms, .ticks = 5, .others = 0};
/// Packets come.
constexpr InterferenceLook kBusy{
    .taken = 1ms, .usual = 50us, .longest = 70us, .worst = 90us, .ticks = 5, .others = 80};

Looks looks_of(std::size_t quiet, std::size_t other, const InterferenceLook& kind) {
    Looks looks(quiet, kQuiet);
    looks.insert(looks.end(), other, kind);
    return looks;
}

TEST(Interference, IsCountedByItsShareOfTheCore) {
    const Interference found = interference_of(Looks(25, kQuiet), {});
    EXPECT_EQ(found.found.share_ppm, 15'000);  // 300 us of 20 ms
    EXPECT_EQ(found.counts.share_ppm, 22'500) << "half as much again";
    const sched::PlatformInterferer counted = found.counted();
    EXPECT_EQ(counted.cost, 90us);
    EXPECT_EQ(counted.interval, 4ms);
    EXPECT_EQ(counted.jitter, counted.interval) << "two at once";
    EXPECT_EQ(found.counted_once().interference(10s), 91500ns);
}

TEST(Interference, AStallOfTheHostIsReportedAndNotCounted) {
    const Interference quiet = interference_of(Looks(25, kQuiet), {});
    const Interference found = interference_of(looks_of(24, 1, kStalled), {});
    EXPECT_EQ(found.counts, quiet.counts);
    EXPECT_EQ(found.worst, 8ms);
}

TEST(Interference, ABurstInEveryTenthLookIsCounted) {
    const Interference found = interference_of(looks_of(20, 5, kBusy), {});
    const sched::PlatformInterferer counted = found.counted();
    EXPECT_GE(counted.interference(20ms), kBusy.taken);
    // In the long run the mean counts: a fifth of the looks had 1 ms, the worst twentieth is left
    // out.
    EXPECT_LT(counted.interference(1s), 2 * 25 * (20 * 300us + 5 * 1ms) * 2 / 25 + 4 * counted.cost);
}

TEST(Interference, CountsWhatItCountedUntilTheComputerDiffers) {
    const InterferenceFigures before = interference_of(Looks(25, kQuiet), {}).counts;
    InterferenceLook more = kQuiet;
    more.taken = 440us;
    EXPECT_EQ(interference_of(Looks(25, more), before).counts, before);
    more.taken = 460us;  // more than is counted
    EXPECT_EQ(interference_of(Looks(25, more), before).counts.share_ppm, 34'500);
    InterferenceLook less = kQuiet;
    less.taken = 220us;  // less than half of it
    EXPECT_EQ(interference_of(Looks(25, less), before).counts.share_ppm, 16'500);
}

TEST(Interference, ASilentCoreCountsNothing) {
    const Interference silent = interference_of(Looks(25), {});
    EXPECT_TRUE(silent.measured);
    EXPECT_EQ(silent.counted().interference(10s), Nanoseconds{0});
    EXPECT_FALSE(interference_of({}, {}).measured);
    EXPECT_EQ(Interference{}.counted().interference(10s), Nanoseconds{0});
}

TEST(Interference, OfARunIsWhatItsInterruptsWouldHaveTaken) {
    const Interference known = interference_of(looks_of(10, 10, kBusy), {});
    const auto look = look_of_run(known, 10s, 40'000);
    ASSERT_TRUE(look);
    EXPECT_EQ(look->others, 80);
    EXPECT_EQ(look->ticks, 5);
    EXPECT_EQ(look->taken, 85 * known.each);
    EXPECT_FALSE(look_of_run({}, 10s, 1)) << "nobody knows how long an interrupt is";
}

TEST(InterferenceMemory, IsTheSameFromStartToStart) {
    FakeMachine machine;
    InterferenceMemory first;
    first.add(looks_of(20, 5, kBusy));
    const Interference told = first.interference();
    ASSERT_TRUE(first.write(0, machine.root()));
    InterferenceMemory second = InterferenceMemory::read(0, machine.root());
    EXPECT_EQ(second.size(), 25u);
    second.add(Looks(5, kQuiet));
    EXPECT_EQ(second.interference().counts, told.counts);
    EXPECT_EQ(InterferenceMemory::read(1, machine.root()).size(), 0u) << "of another core";
}

TEST(InterferenceMemory, OldLooksGo) {
    InterferenceMemory memory;
    memory.add(Looks(InterferenceMemory::kLooks, kBusy));
    memory.add(Looks(InterferenceMemory::kLooks, kQuiet));
    EXPECT_EQ(memory.size(), InterferenceMemory::kLooks);
    EXPECT_EQ(memory.interference().found.share_ppm, 15'000);
}

TEST(InterferenceMemory, LeavesOutWhatIsMalformed) {
    for (const char* line : {"look 1 2 3 4 5\n", "look 1 2 3 4 5 -6\n", "look 1 2 3 4 5 x\n", "look\n",
                             "look 1 2 3 4 5 6 7\n", "look 99999999999 2 3 4 5 6\n", "counted 1 2\n", "\n"})
        EXPECT_EQ(InterferenceMemory::parse(line).size(), 0u) << line;
    const InterferenceMemory read = InterferenceMemory::parse("counted 1 2 3 4\nlook 1 2 3 4 5 6\n");
    EXPECT_EQ(read.size(), 1u);
    EXPECT_EQ(read.text(), "counted 1 2 3 4\nlook 1 2 3 4 5 6\n");
}

TEST(InterferenceMemory, FiguresMayBeSaidInstead) {
    const auto said = InterferenceMemory::figures_said("15000 75000 100000 90000");
    ASSERT_TRUE(said);
    EXPECT_EQ(*said, (InterferenceFigures{15'000, 75us, 100us, 90us}));
    for (const char* text : {"", "1 2 3", "1 2 3 4 5", "1 2 3 -4", "1 2 3 4us"})
        EXPECT_FALSE(InterferenceMemory::figures_said(text)) << text;
}

TEST(InterferenceMemory, BelievesNoFileOfAStranger) {
    FakeMachine machine;
    machine.put("/elsewhere", "look 1 2 3 4 5 6");
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
    EXPECT_GE(found[0].worst, found[0].longest);
    EXPECT_TRUE(look_for_interference(100'000, 10, 1).empty()) << "there is no such core";
}

}  // namespace
}  // namespace qduino::board::linux::interference_test
