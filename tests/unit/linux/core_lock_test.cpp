// One owner for each core: the second is refused by the first one's name, and whoever dies has
// given it back.
#include "board/linux/computer/core_lock.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

#include "board/linux/kernel/real_time_thread.h"
#include "posix/unique_fd.h"
#include "tests/unit/linux/fake_machine.h"
#include "tests/unit/linux/stranger.h"

namespace qduino::board::linux::test::core_lock_test {

using posix::UniqueFd;
using qduino::test::Stranger;
using qduino::test::why_no_stranger;
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

std::string refusal_of(int core, Nanoseconds patience, const FakeMachine& machine) {
    const auto lock = CoreLock::take(core, patience, machine.root());
    if (lock) return "it was not refused";
    EXPECT_EQ(lock.error().code, ErrorCode::unavailable);
    return std::string{lock.error().message.view()};
}

std::string lock_of(const FakeMachine& machine, int core) {
    const auto folder = own_register(machine.root());
    EXPECT_TRUE(folder.ok());
    return *folder + "/qduino-core" + std::to_string(core) + ".lock";
}

std::string words_in(const std::string& file) {
    std::ifstream in{file};
    std::stringstream words;
    words << in.rdbuf();
    return words.str();
}

/// Another process that owns core 1, for `length`.
class Owner {
  public:
    Owner(const FakeMachine& machine, std::chrono::milliseconds length) {
        int ends[2] = {-1, -1};
        EXPECT_EQ(::pipe(ends), 0);
        const UniqueFd told{ends[0]};
        UniqueFd tell{ends[1]};
        pid_ = ::fork();
        if (pid_ == 0) {
            ::prctl(PR_SET_PDEATHSIG, SIGKILL);
            name_thread("first owner");
            const auto lock = CoreLock::take(1, 0s, machine.root());
            const char took = lock ? 'y' : 'n';
            static_cast<void>(!::write(tell.get(), &took, 1));
            std::this_thread::sleep_for(length);
            ::_exit(0);  // as a kill: nothing is given back in order
        }
        tell.reset();
        char took = 0;
        EXPECT_EQ(::read(told.get(), &took, 1), 1);
        EXPECT_EQ(took, 'y');
    }
    ~Owner() { kill(); }
    Owner(const Owner&) = delete;
    Owner& operator=(const Owner&) = delete;
    void kill() {
        if (pid_ <= 0) return;
        ::kill(pid_, SIGKILL);
        ::waitpid(pid_, nullptr, 0);
        pid_ = -1;
    }
    [[nodiscard]] pid_t pid() const { return pid_; }

  private:
    pid_t pid_ = -1;
};

TEST(CoreLock, TheSecondOwnerIsToldTheFirstByName) {
    const FakeMachine machine;
    Owner first{machine, 20s};
    const std::string refused = refusal_of(1, 30ms, machine);
    EXPECT_THAT(refused, HasSubstr("core 1 is taken: first owner (pid " + std::to_string(first.pid()) +
                                   ") owns it since 20"));
    EXPECT_THAT(refused, HasSubstr("started as `unit-linux-host"));
    EXPECT_THAT(refused, HasSubstr("stop that one, or give the loop another core"));
    EXPECT_LT(refused.size(), decltype(Error::message)::kCapacity) << "nothing of it was cut";
    EXPECT_TRUE(CoreLock::take(0, 0s, machine.root()).ok()) << "another core is free";

    first.kill();
    const auto mine = CoreLock::take(1, 2s, machine.root());
    ASSERT_TRUE(mine.ok()) << mine.error().message.view();
    EXPECT_THAT(words_in(lock_of(machine, 1)), HasSubstr("pid " + std::to_string(::getpid()) + "\nsince 20"));
}

TEST(CoreLock, WaitsForAPredecessorThatIsJustDying) {
    const FakeMachine machine;
    const Owner first{machine, 200ms};
    EXPECT_TRUE(CoreLock::take(1, 20s, machine.root()).ok());
}

TEST(CoreLock, IsGivenBackAndItsFileTakenAway) {
    const FakeMachine machine;
    {
        const auto first = CoreLock::take(1, 0s, machine.root());
        ASSERT_TRUE(first.ok());
        EXPECT_EQ(first->path(), lock_of(machine, 1));
        EXPECT_THAT(refusal_of(1, 0s, machine), HasSubstr("(pid " + std::to_string(::getpid()) + ")"));
    }
    EXPECT_FALSE(std::filesystem::exists(lock_of(machine, 1)));
    EXPECT_TRUE(CoreLock::take(1, 0s, machine.root()).ok());
}

TEST(CoreLock, WithoutAFolderOfItsOwnItSaysSoAndKeepsNobodyOut) {
    const FakeMachine machine;
    for (const char* folder : {"/run", "/dev", "/tmp"}) std::filesystem::remove_all(machine.path(folder));
    const auto lock = CoreLock::take(1, 0s, machine.root());
    ASSERT_FALSE(lock.ok());
    EXPECT_EQ(lock.error().code, ErrorCode::not_permitted);
}

TEST(CoreLock, AUsersSketchSeesThatRootHasTheCore) {
    if (!why_no_stranger().empty()) GTEST_SKIP() << why_no_stranger();
    const FakeMachine machine;
    const auto roots = CoreLock::take(1, 0s, machine.root());
    ASSERT_TRUE(roots.ok());
    const Stranger user{[&] {
        return refusal_of(1, 0s, machine).find(std::to_string(::getppid())) != std::string::npos &&
               CoreLock::take(0, 0s, machine.root()).ok();
    }};
    EXPECT_TRUE(user.succeeded()) << "root's core is refused with root's words; another one is his";
}

TEST(CoreLock, NoUserKeepsRootFromACore) {
    if (!why_no_stranger().empty()) GTEST_SKIP() << why_no_stranger();
    const FakeMachine machine;
    ASSERT_TRUE(CoreLock::take(0, 0s, machine.root()).ok()) << "root's folder is there";
    {
        Owner killed{machine, 20s};
        killed.kill();  // its file stays, and every user may read it
    }
    const std::string file = lock_of(machine, 1);
    ASSERT_TRUE(std::filesystem::exists(file));
    const Stranger attacker{[&] {
        for (const char* folder : {"/run/lock", "/dev/shm", "/tmp", "/run/qduino"}) {
            const std::string planted = machine.path(folder) + "/qduino-core1.lock";
            const int fd = ::open(planted.c_str(), O_RDWR | O_CREAT, 0666);
            if (fd >= 0) ::flock(fd, LOCK_EX);
        }
        const int fd = ::open(file.c_str(), O_RDONLY);
        struct flock reading {};
        reading.l_type = F_RDLCK;
        return ::flock(fd, LOCK_EX) == 0 && ::fcntl(fd, F_OFD_SETLK, &reading) == 0;
    }};
    ASSERT_TRUE(attacker.succeeded()) << "he has every lock that the kernel gives him";
    const auto lock = CoreLock::take(1, 2s, machine.root());
    EXPECT_TRUE(lock.ok()) << lock.error().message.view();
    EXPECT_FALSE(refusal_of(1, 0s, machine).empty()) << "and it is root's now";
}

TEST(CoreLock, WhatAnotherWroteIntoTheFileIsNotBelieved) {
    const FakeMachine machine;
    const auto lock = CoreLock::take(1, 0s, machine.root());
    ASSERT_TRUE(lock.ok());
    std::ofstream{lock->path()} << "pid $(reboot)\nprogram \033[31m" << std::string(3000, 'x');
    EXPECT_EQ(refusal_of(1, 0s, machine),
              "core 1 is taken: another sketch owns it: stop that one, or give the loop another core");
}

}  // namespace
}  // namespace qduino::board::linux::test::core_lock_test
