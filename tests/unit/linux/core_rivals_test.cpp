// The search for the task that took a core: on a /proc made of files, and, for root, on the real
// one.
#include "board/linux/kernel/core_rivals.h"

#include <gtest/gtest.h>

#include <new>

#include "tests/unit/linux/fake_machine.h"
#include "tests/unit/linux/foreign_spinner.h"

namespace qduino::board::linux::test::core_rivals_test {
namespace {

constexpr int kFifo = 1, kRoundRobin = 2, kDeadline = 6;

struct Task {
    int pid = 0, tid = 0;
    std::string name = "task";
    char state = 'S';
    int core = 1, priority = 0, policy = 0, ticks = 0;
};

/// As /proc writes it: field 3 is the state, 14 and 15 the ticks, 39 the core, 40 the priority, 41
/// the policy.
void put(FakeMachine& machine, const Task& task) {
    std::string line = std::to_string(task.tid) + " (" + task.name + ") " + task.state;
    for (int field = 4; field <= 52; ++field) {
        const int number = field == 14   ? task.ticks / 2
                           : field == 15 ? task.ticks - task.ticks / 2
                           : field == 39 ? task.core
                           : field == 40 ? task.priority
                           : field == 41 ? task.policy
                                         : 7;
        line += " " + std::to_string(number);
    }
    machine.put("/proc/" + std::to_string(task.pid) + "/task/" + std::to_string(task.tid) + "/stat", line);
}

std::string rival_on(
    const FakeMachine& machine, std::function<void()> wait = [] {}) {
    const auto rival = find_core_rival(
        {.core = 1, .priority = 80, .not_of = 500, .root = machine.root(), .wait = std::move(wait)});
    return rival ? rival->name + " " + std::to_string(rival->pid) + "/" + std::to_string(rival->tid) : "";
}

TEST(CoreRivals, IsWhoRunsOnTheCoreAtThePriorityOrAHigherOne) {
    FakeMachine machine;
    // The sketch itself.
    put(machine, {.pid = 500, .tid = 502, .name = "loop 2", .state = 'R', .priority = 80, .policy = kFifo});
    put(machine, {.pid = 10,
                  .tid = 10,
                  .name = "other core",
                  .state = 'R',
                  .core = 0,
                  .priority = 90,
                  .policy = kFifo});
    put(machine, {.pid = 11, .tid = 11, .name = "lower", .state = 'R', .priority = 79, .policy = kFifo});
    put(machine, {.pid = 12, .tid = 12, .name = "ordinary", .state = 'R'});
    put(machine,
        {.pid = 13, .tid = 13, .name = "migration/1", .state = 'S', .priority = 99, .policy = kFifo});
    machine.put("/proc/14/task/14/stat", "no such line");
    machine.put("/proc/version", "not a process");
    EXPECT_EQ(rival_on(machine), "");
    put(machine,
        {.pid = 4711, .tid = 4713, .name = "a (b) c", .state = 'R', .priority = 80, .policy = kRoundRobin});
    EXPECT_EQ(rival_on(machine), "a (b) c 4711/4713");
}

TEST(CoreRivals, OneThatSleepsWhenLookedAtIsKnownByItsTime) {
    FakeMachine machine;
    const auto asleep = [&](int pid, int ticks) {
        put(machine, {.pid = pid, .tid = pid, .priority = 85, .policy = kFifo, .ticks = ticks});
    };
    asleep(20, 100);
    asleep(21, 100);
    EXPECT_EQ(rival_on(machine), "");
    EXPECT_EQ(rival_on(machine, [&] { asleep(20, 103), asleep(21, 105); }), "task 21/21");
    EXPECT_EQ(rival_on(machine, [&] { asleep(20, 104); }), "")
        << "one tick may be a moment of somebody who wakes often";
    EXPECT_EQ(rival_on(machine, [&] { std::filesystem::remove_all(machine.path("/proc")); }), "")
        << "it has ended";
}

TEST(CoreRivals, ADeadlineTaskGoesBeforeEveryPriority) {
    FakeMachine machine;
    put(machine, {.pid = 30, .tid = 30, .name = "dl", .state = 'R', .policy = kDeadline});
    EXPECT_EQ(rival_on(machine), "dl 30/30");
}

TEST(CoreRivals, TheSentenceNamesCoreTaskAndPriority) {
    FakeMachine machine;
    put(machine,
        {.pid = 4711, .tid = 4711, .name = "stress-ng", .state = 'R', .priority = 85, .policy = kFifo});
    const auto layout = std::make_unique<PinsLayout>();
    EXPECT_EQ(who_took_the_core_of(2, *layout, 500, machine.root()), "")
        << "the loop has not said where it runs";
    layout->heartbeats[2].place.store(LoopPlace{.core = 1, .priority = 80}.word());
    EXPECT_EQ(who_took_the_core_of(2, *layout, 500, machine.root()),
              "core 1 was taken by stress-ng (pid 4711, SCHED_FIFO 85)");
    EXPECT_EQ(who_took_the_core_of(2, *layout, 4711, machine.root()), "") << "it is the sketch's own";
    layout->heartbeats[2].place.store(LoopPlace{.core = 0, .priority = 80}.word());
    EXPECT_EQ(who_took_the_core_of(2, *layout, 500, machine.root()), "");
    put(machine, {.pid = 4711, .tid = 4711, .name = "dl", .state = 'R', .core = 0, .policy = kDeadline});
    EXPECT_EQ(who_took_the_core_of(2, *layout, 500, machine.root()),
              "core 0 was taken by dl (pid 4711, SCHED_DEADLINE)");
}

TEST(CoreRivals, OfASketchTheyAreLookedForOnEachOfItsCores) {
    FakeMachine machine;
    const auto layout = std::make_unique<PinsLayout>();
    EXPECT_EQ(who_took_a_core_of(*layout, 500, machine.root()), "");
    layout->heartbeats[1].place.store(LoopPlace{.core = 0, .priority = 70}.word());
    layout->heartbeats[2].place.store(LoopPlace{.core = 1, .priority = 80}.word());
    layout->heartbeats[3].place.store(LoopPlace{.core = 1, .priority = 60}.word());
    put(machine, {.pid = 4711, .tid = 4711, .state = 'R', .core = 2, .priority = 99, .policy = kFifo});
    EXPECT_EQ(who_took_a_core_of(*layout, 500, machine.root()), "");
    put(machine, {.pid = 4712, .tid = 4712, .state = 'R', .core = 1, .priority = 65, .policy = kFifo});
    EXPECT_EQ(who_took_a_core_of(*layout, 500, machine.root()),
              "core 1 was taken by task (pid 4712, SCHED_FIFO 65)")
        << "in front of the lower of two loops there";
}

TEST(CoreRivals, AreFoundOnTheRealMachine) {
    if (cpu_count() < 2) GTEST_SKIP() << "needs two cores";
    const int core = cpu_count() - 1;
    // Priorities below those of the computer's own threads: the test disturbs nobody who matters.
    const ForeignSpinner thief{core, 3, 5s};
    if (!thief.spins())
        GTEST_SKIP() << "needs SCHED_FIFO: errors " << thief.core_error() << ", " << thief.priority_error();
    const auto rival = find_core_rival({.core = core, .priority = 2, .not_of = 0, .root = {}, .wait = {}});
    if (!thief.lives()) GTEST_SKIP() << "this computer stood still for as long as the thief lived";
    ASSERT_TRUE(rival);
    EXPECT_EQ(rival->pid, thief.pid());
    EXPECT_EQ(rival->name, "core-thief");
    EXPECT_EQ(rival->policy, kFifo);
    EXPECT_EQ(rival->priority, 3);
    const auto above = find_core_rival({.core = core, .priority = 4, .not_of = 0, .root = {}, .wait = {}});
    EXPECT_TRUE(!above || above->pid != thief.pid())
        << "a loop with a higher priority is not kept waiting by it";
    const std::string name = "core-thief (pid " + std::to_string(thief.pid()) + ", SCHED_FIFO 3)";
    // The kernel stops it for 50 ms of each second, and the host whenever it likes: one look in
    // many finds it at work.
    bool seen = false;
    while (!seen && thief.lives()) seen = who_spins_on(core, 0) == name;
    EXPECT_TRUE(seen);
    EXPECT_EQ(who_spins_on(core, thief.pid()), "") << "it is the sketch's own";
}

}  // namespace
}  // namespace qduino::board::linux::test::core_rivals_test
