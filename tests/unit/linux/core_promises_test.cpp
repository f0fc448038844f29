// The register of promises: what a program writes another one reads, the dead count no more, and
// what somebody else put there does no harm.
#include "board/linux/computer/core_promises.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <optional>

#include "board/linux/computer/loop_promise.h"
#include "tests/unit/linux/fake_machine.h"
#include "tests/unit/linux/stranger.h"

namespace qduino::board::linux::test::core_promises_test {

using qduino::test::Stranger;
using qduino::test::why_no_stranger;

namespace {

Promise sample_promise() {
    Promise promise;
    promise.program = "printer";
    promise.vcpus = {{.id = 1, .budget = 30ms, .period = 100ms, .core = 0, .kind = sched::VcpuKind::main},
                     {.id = 33, .budget = 1ms, .period = 100ms, .core = 0, .kind = sched::VcpuKind::io}};
    promise.vcpus[0].suspension = 2ms;
    promise.vcpus[0].sleeps = 3;
    promise.vcpus[0].deferrable = true;
    promise.vcpus[1].client_period = 100ms;
    promise.takers = {{0, {.name = FixedString<23>{"the tick"}, .cost = 5us, .interval = 4ms, .jitter = 0ns}},
                      {0,
                       {.name = FixedString<23>{"interrupts"},
                        .cost = 10us,
                        .interval = 300us,
                        .jitter = 20ms,
                        .peak_interval = 120us,
                        .peak_jitter = 9ms}}};
    promise.trees = {{.name = "print service", .core = 0, .budget = 10ms, .period = 100ms}};
    promise.groups = {"/sys/fs/cgroup/cpu/qduino-vcpu.1.0"};
    return promise;
}

PromiseRegister open_register(const FakeMachine& machine) {
    auto opened = PromiseRegister::open(machine.root());
    EXPECT_TRUE(opened);
    return std::move(*opened);
}

TEST(CorePromises, AnotherProgramReadsWhatOneHasWritten) {
    const FakeMachine machine;
    std::optional<HeldPromise> held;
    {
        const PromiseRegister promises = open_register(machine);
        auto made = promises.hold(sample_promise(), promises.free_name());
        ASSERT_TRUE(made) << made.error().message.view();
        held = std::move(*made);
    }
    {
        const PromiseRegister promises = open_register(machine);
        ASSERT_EQ(promises.living().size(), 1u);
        const Promise& read = promises.living()[0];
        EXPECT_EQ(read.pid, ::getpid());
        EXPECT_EQ(promise_text(read), promise_text(sample_promise()));
        EXPECT_EQ(read.vcpus.size(), 2u);
        EXPECT_TRUE(read.vcpus[1].is_io());
        EXPECT_EQ(read.vcpus[0].suspension, 2ms);
        EXPECT_EQ(read.vcpus[0].sleeps, 3);
        EXPECT_TRUE(read.vcpus[0].deferrable);
        EXPECT_EQ(read.vcpus[1].client_period, 100ms);
        ASSERT_EQ(read.takers.size(), 2u);
        EXPECT_EQ(read.takers[0].interferer, sample_promise().takers[0].interferer);
        EXPECT_EQ(read.takers[1].interferer, sample_promise().takers[1].interferer);
        EXPECT_EQ(read.trees[0].name, "print service");
        EXPECT_NE(promises.free_name(), std::to_string(::getpid()) + ".0") << "that one is taken";
    }
    held.reset();
    EXPECT_TRUE(open_register(machine).living().empty()) << "taken back";
}

TEST(CorePromises, APromiseThatChangedIsReadAnew) {
    const FakeMachine machine;
    const auto made = open_register(machine).hold(sample_promise(), "7.0");
    ASSERT_TRUE(made);
    Promise changed = sample_promise();
    changed.groups.clear();  // a shorter text
    changed.vcpus[1].budget = 3ms;
    PromiseRegister::rewrite(*made, changed);
    const PromiseRegister promises = open_register(machine);
    ASSERT_EQ(promises.living().size(), 1u);
    EXPECT_EQ(promise_text(promises.living()[0]), promise_text(changed));
}

TEST(CorePromises, AKilledHoldersPromiseCountsNoMore) {
    const FakeMachine machine;
    const pid_t holder = ::fork();
    if (holder == 0) {
        const PromiseRegister promises = open_register(machine);
        const auto held = promises.hold(sample_promise(), promises.free_name());
        ::_exit(held ? 0 : 1);  // as a kill: nothing is taken back
    }
    int status = -1;
    ::waitpid(holder, &status, 0);
    ASSERT_EQ(status, 0);
    {
        const PromiseRegister promises = open_register(machine);
        EXPECT_TRUE(promises.living().empty());
        ASSERT_EQ(promises.dead().size(), 1u);
        EXPECT_EQ(promises.dead()[0].groups, sample_promise().groups);
        promises.put_dead_away(1s);
    }
    EXPECT_TRUE(open_register(machine).dead().empty());
}

TEST(CorePromises, LinesThatCannotBeAreLeftOut) {
    const Promise read = read_promise(
        "program x\x1b[31m\nmain 1 0 5 10\nmain 2 0 11 10\nmain 3 0 -5 10\nmain 4 99999 5 10\nmain 300 0 5 "
        "10\n"
        "main 5 0 5\nio 33 0 1 99999999999999999999\ntaker 0 5 0 0 zero interval\ntree 0 0 100 none\n"
        "tree 0 5 3 more\ntree 0 5 10 good\nmain\n\nnonsense 1 2 3\n");
    EXPECT_EQ(read.program, "x [31m");
    ASSERT_EQ(read.vcpus.size(), 1u);
    EXPECT_EQ(read.vcpus[0].id, 1);
    EXPECT_TRUE(read.takers.empty());
    ASSERT_EQ(read.trees.size(), 1u);
    EXPECT_EQ(read.trees[0].name, "good");
}

TEST(CorePromises, AFileThatNobodyHoldsAndNoFileDoNoHarm) {
    const FakeMachine machine;
    const auto folder = own_register(machine.root());
    ASSERT_TRUE(folder);
    std::ofstream{*folder + "/qduino-promise.1.0"} << "tree 0 5000000 10000000 dead\n";
    std::filesystem::create_directories(*folder + "/qduino-promise.2.0");
    std::filesystem::create_symlink("/etc/passwd", *folder + "/qduino-promise.3.0");
    ASSERT_EQ(::mkfifo((*folder + "/qduino-promise.4.0").c_str(), 0600), 0);
    std::filesystem::create_hard_link(*folder + "/qduino-promise.1.0", *folder + "/another-name");
    EXPECT_TRUE(open_register(machine).dead().empty()) << "a file with a second name may be a foreign one";
    std::filesystem::remove(*folder + "/another-name");
    const PromiseRegister promises = open_register(machine);
    EXPECT_TRUE(promises.living().empty());
    EXPECT_EQ(promises.dead().size(), 1u);
}

TEST(CorePromises, AFileThatIsLargeWithoutBeingWrittenIsNotRead) {
    const FakeMachine machine;
    const auto held = open_register(machine).hold(sample_promise(), "7.0");
    ASSERT_TRUE(held);
    ASSERT_EQ(::ftruncate(held->descriptor(), kRegisterFileBytesMax), 0);
    EXPECT_EQ(open_register(machine).living().size(), 1u);
    ASSERT_EQ(::ftruncate(held->descriptor(), kRegisterFileBytesMax + 1), 0);
    EXPECT_TRUE(open_register(machine).living().empty());
    // Far more than the memory of any computer: reading it would take all of that.
    ASSERT_EQ(::ftruncate(held->descriptor(), off_t{1} << 42), 0);
    EXPECT_TRUE(open_register(machine).living().empty());
}

TEST(CorePromises, NoUserStopsRootsProgramsOrTakesTheirMemory) {
    if (!why_no_stranger().empty()) GTEST_SKIP() << why_no_stranger();
    const FakeMachine machine;
    const auto held = open_register(machine).hold(sample_promise(), "7.0");
    ASSERT_TRUE(held);
    const pid_t killed = ::fork();
    if (killed == 0) {
        const auto left = open_register(machine).hold(sample_promise(), "8.0");
        ::_exit(left ? 0 : 1);  // its file stays, and every user may read it
    }
    ::waitpid(killed, nullptr, 0);
    const Stranger attacker{[&] {
        int planted = 0;
        for (const char* folder : {"/run/lock", "/dev/shm", "/tmp", "/run/qduino"}) {
            for (const char* name : {"/qduino-promises.lock", "/qduino-promise.1.0", "/qduino-promise.7.0",
                                     "/qduino-promise.8.0"}) {
                const std::string path = machine.path(folder) + name;
                int fd = ::open(path.c_str(), O_RDWR | O_CREAT, 0666);
                if (fd < 0) fd = ::open(path.c_str(), O_RDONLY);
                if (fd < 0) continue;
                ++planted;
                static_cast<void>(::ftruncate(fd, off_t{1} << 42) == 0);
                ::flock(fd, LOCK_EX);
                struct flock reading {};
                reading.l_type = F_RDLCK;
                ::fcntl(fd, F_OFD_SETLK, &reading);
            }
        }
        return planted > 0;
    }};
    ASSERT_TRUE(attacker.succeeded());
    const auto opened = PromiseRegister::open(machine.root(), 1s);
    ASSERT_TRUE(opened) << opened.error().message.view();
    ASSERT_EQ(opened->living().size(), 1u) << "root's own that lives, and nothing else";
    EXPECT_EQ(promise_text(opened->living()[0]), promise_text(sample_promise()));
}

TEST(CorePromises, AUserReadsWhatRootHasPromised) {
    if (!why_no_stranger().empty()) GTEST_SKIP() << why_no_stranger();
    const FakeMachine machine;
    const auto held = open_register(machine).hold(sample_promise(), "7.0");
    ASSERT_TRUE(held);
    const Stranger user{[&] {
        const auto mine = PromiseRegister::open(machine.root(), 0s);
        return mine && mine->living().size() == 1 && mine->living()[0].trees.size() == 1 &&
               mine->hold(sample_promise(), mine->free_name());
    }};
    EXPECT_TRUE(user.succeeded());
}

/// The promises of this user that lie there, the living and the dead.
std::size_t promise_files(const FakeMachine& machine) {
    const auto folder = own_register(machine.root());
    EXPECT_TRUE(folder);
    return static_cast<std::size_t>(std::ranges::count_if(
        std::filesystem::directory_iterator{*folder},
        [](const auto& each) { return each.path().filename().native().starts_with("qduino-promise."); }));
}

TEST(LoopPromise, EachStartRemovesWhatDeadProgramsLeftAndNothingElse) {
    const FakeMachine machine;
    const auto living = open_register(machine).hold(sample_promise(), "7.0");
    ASSERT_TRUE(living);
    VcpuSpec spec;
    static_cast<sched::Vcpu&>(spec) = {.id = 1, .budget = 1ms, .period = 100ms, .core = 0};
    const auto start = [&](LoopPromise& loops) {
        loops.make(
            std::vector{spec}, [](int) { return sched::PlatformOverheads{}; }, machine.root());
    };
    for (int killed = 0; killed < 5; ++killed) {
        const pid_t sketch = ::fork();
        if (sketch == 0) {
            LoopPromise loops;
            start(loops);
            ::_exit(0);  // as a kill: nothing is taken back
        }
        ASSERT_EQ(::waitpid(sketch, nullptr, 0), sketch);
        EXPECT_EQ(promise_files(machine), 2u) << "those of the living one and of the last dead one";
    }
    const auto folder = own_register(machine.root());
    ASSERT_TRUE(folder);
    // A record that names a group which nobody may remove stays.
    std::ofstream{*folder + "/qduino-promise.9.0"} << "tree 0 5000000 10000000 dead\ngroup /proc/not-ours\n";
    LoopPromise loops;
    start(loops);
    EXPECT_EQ(promise_files(machine), 3u) << "of the living one, of this one, and the one that stays";
    EXPECT_EQ(open_register(machine).living().size(), 2u);
}

TEST(LoopPromise, ASketchTellsItsLoopsAndNamesTheTreesOnItsCores) {
    const FakeMachine machine;
    Promise tree;
    tree.trees = {{.name = "print service", .core = 0, .budget = 10ms, .period = 100ms}};
    tree.groups = {"/g/qduino-vcpu.1.0"};
    Promise elsewhere;
    elsewhere.trees = {{.name = "far away", .core = 5, .budget = 10ms, .period = 100ms}};
    std::vector<HeldPromise> held;
    for (const Promise& each : {tree, elsewhere}) {
        const PromiseRegister promises = open_register(machine);
        auto made = promises.hold(each, promises.free_name());
        ASSERT_TRUE(made);
        held.push_back(std::move(*made));
    }
    VcpuSpec first, owner;
    static_cast<sched::Vcpu&>(first) = {.id = 1, .budget = 95ms, .period = 100ms, .core = 0};
    static_cast<sched::Vcpu&>(owner) = {.id = 2, .budget = 1ms, .period = 1ms, .core = 1};
    owner.owns_core = true;
    sched::PlatformOverheads overheads;
    overheads.release_cost = 100us;
    LoopPromise loops;
    loops.make(
        std::vector{first, owner}, [&](int) { return overheads; }, machine.root());
    {
        const PromiseRegister promises = open_register(machine);
        ASSERT_EQ(promises.living().size(), 3u);
        const auto sketch =
            std::ranges::find_if(promises.living(), [](auto& each) { return !each.vcpus.empty(); });
        EXPECT_EQ(sketch->vcpus[0].budget, 95100us) << "with what an activation costs";
        EXPECT_TRUE(sketch->vcpus[1].parameters().whole_core());
    }
    GuaranteeReport report;
    loops.describe_trees(report);
    ASSERT_EQ(report.trees.size(), 1u);
    EXPECT_EQ(report.trees[0].name.view(), "print service");
    EXPECT_TRUE(report.trees[0].enforced);
    EXPECT_FALSE(report.trees[0].admitted) << "the loop leaves 4.9 of 100 ms";
    EXPECT_THAT(std::string{report.trees[0].shortfall.view()}, ::testing::HasSubstr("loop 1 of"));
    loops.change(1, {94ms, 100ms});
    EXPECT_EQ(open_register(machine).living().back().vcpus[0].budget, 94100us);
}

}  // namespace
}  // namespace qduino::board::linux::test::core_promises_test
