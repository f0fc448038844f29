// One owner for each core: the second is refused by the first one's name, and whoever dies has
// given it back.
#include "board/linux/core_lock.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

#include "board/linux/real_time_thread.h"
#include "posix/unique_fd.h"
#include "tests/unit/linux/fake_machine.h"

namespace qduino::board::linux::test::core_lock_test {

using posix::UniqueFd;
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

std::string refusal_of(int core, Nanoseconds patience, const FakeMachine& machine) {
    const auto lock = CoreLock::take(core, patience, machine.root());
    if (lock) return "it was not refused";
    EXPECT_EQ(lock.error().code, ErrorCode::unavailable);
    return std::string{lock.error().message.view()};
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
    EXPECT_THAT(machine.get("/run/lock/qduino-core1.lock"),
                HasSubstr("pid " + std::to_string(::getpid()) + "\nsince 20"));
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
        EXPECT_EQ(first->path(), machine.path("/run/lock/qduino-core1.lock"));
        EXPECT_THAT(refusal_of(1, 0s, machine), HasSubstr("(pid " + std::to_string(::getpid()) + ")"));
    }
    EXPECT_FALSE(std::filesystem::exists(machine.path("/run/lock/qduino-core1.lock")));
    EXPECT_TRUE(CoreLock::take(1, 0s, machine.root()).ok());
}

TEST(CoreLock, AllUsersMeetInTheFirstFolderThatIsEverybodys) {
    const FakeMachine machine;
    for (const char* folder : {"/dev/shm", "/tmp"}) {
        std::filesystem::create_directories(machine.path(folder));
        ::chmod(machine.path(folder).c_str(), 01777);
    }
    // Root alone may write there, and must not go there.
    ::chmod(machine.path("/run/lock").c_str(), 0755);
    const auto lock = CoreLock::take(1, 0s, machine.root());
    ASSERT_TRUE(lock.ok());
    EXPECT_EQ(lock->path(), machine.path("/dev/shm/qduino-core1.lock"));
    struct stat status {};
    ASSERT_EQ(::stat(lock->path().c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0666u) << "another user may look at it and wait for it";
}

TEST(CoreLock, WithNoFolderAtAllItSaysSoAndKeepsNobodyOut) {
    const FakeMachine machine;
    std::filesystem::remove_all(machine.path("/run/lock"));
    const auto lock = CoreLock::take(1, 0s, machine.root());
    ASSERT_FALSE(lock.ok());
    EXPECT_EQ(lock.error().code, ErrorCode::not_permitted);
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
