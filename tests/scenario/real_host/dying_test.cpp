// A sketch is killed while a task of another program spins on its core, in front of its loop. It
// dies all the same, at once: its supervisor lets its threads die, says who took the core, and puts
// the computer's settings back, while the other task spins on.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "board/linux/computer/core_lock.h"
#include "board/linux/kernel/core_rivals.h"
#include "board/linux/kernel/host_settings.h"
#include "board/linux/kernel/kernel_text.h"
#include "board/linux/kernel/real_time_thread.h"
#include "tests/unit/linux/foreign_spinner.h"
#include "tests/unit/linux/host_snapshot.h"
#include "tests/unit/linux/pins_fixture.h"

namespace qduino::board::linux::test::dying_test {
namespace {

using ::testing::HasSubstr;

constexpr int kCore = 1;
/// As long as the other task spins; what is waited for comes in a fraction of it.
constexpr Nanoseconds kSpin = 5s;

/// The pulse train, which owns core 1 at real-time priority, below its supervisor.
class TrainUnderSupervisor {
  public:
    explicit TrainUnderSupervisor(bool isolated) : machine_(pins_.path()) {
        const pid_t test = ::getpid();
        supervisor_ = ::fork();
        if (supervisor_ != 0) return;
        ::prctl(PR_SET_PDEATHSIG, SIGTERM);
        if (::getppid() != test) ::_exit(1);
        const int said = ::open(said_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
        ::dup2(said, STDOUT_FILENO);
        ::dup2(said, STDERR_FILENO);
        const std::string pins = pins_.path();
        ::execl(SUPERVISOR, SUPERVISOR, "--pins", pins.c_str(), "--timeout-ms", "0", "--", ISOLATED_SKETCH,
                "--pins", pins.c_str(), "--for", "20", isolated ? "--isolate" : nullptr, nullptr);
        ::_exit(126);
    }
    ~TrainUnderSupervisor() {
        if (!ended()) ::kill(supervisor_, SIGTERM);
        ::waitpid(supervisor_, nullptr, 0);
        std::filesystem::remove(said_);
    }
    TrainUnderSupervisor(const TrainUnderSupervisor&) = delete;
    TrainUnderSupervisor& operator=(const TrainUnderSupervisor&) = delete;

    /// Until its loop runs on its core, with all that was to be changed for it. False: it ended.
    [[nodiscard]] bool runs() {
        while (!ended() && (machine_.machine.edges < 10 || said().find("What holds") == std::string::npos))
            std::this_thread::sleep_for(5ms);
        return !ended();
    }
    void kill_sketch() {
        const auto sketch = static_cast<pid_t>(layout().sketch_pid.load());
        ASSERT_GT(sketch, 0);
        ::kill(sketch, SIGKILL);
    }
    /// The supervisor ends once the sketch is dead and the settings are put back.
    [[nodiscard]] bool ended() const {
        siginfo_t info{};
        return ::waitid(P_PID, static_cast<id_t>(supervisor_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
               info.si_pid != 0;
    }
    [[nodiscard]] std::string said() const {
        std::ifstream file{said_};
        return {std::istreambuf_iterator<char>{file}, {}};
    }
    [[nodiscard]] PinsLayout& layout() { return machine_.server().layout(); }

  private:
    TemporaryPins pins_;
    RunningMachine machine_;
    const std::string said_ = pins_.path() + ".said";
    pid_t supervisor_ = -1;
};

class Dying : public ::testing::Test {
  protected:
    void SetUp() override {
        if (::geteuid() != 0 || cpu_count() < 2) GTEST_SKIP() << "needs root and two cores";
        const auto mine = HostSettings::open(kDefaultSettingsState);
        if (!mine.ok()) GTEST_SKIP() << mine.error().message.view();
        cpu_set_t first;
        ASSERT_EQ(::sched_getaffinity(0, sizeof before_, &before_), 0);
        CPU_ZERO(&first);
        CPU_SET(0, &first);
        // The task takes the other core whole; this test and its children stay away from it.
        ASSERT_EQ(::sched_setaffinity(0, sizeof first, &first), 0);
    }
    void TearDown() override { ::sched_setaffinity(0, sizeof before_, &before_); }

    /// False: `sketch` and its supervisor had not ended when the spinner did.
    static bool ends_while_spun_on(const TrainUnderSupervisor& sketch, const ForeignSpinner& spinner) {
        while (spinner.lives() && !sketch.ended()) std::this_thread::sleep_for(5ms);
        return spinner.lives() && sketch.ended();
    }

  private:
    cpu_set_t before_{};
};

TEST_F(Dying, ASketchBehindATaskOfAHigherPriorityDiesAndTheTaskIsNamed) {
    TrainUnderSupervisor sketch{false};
    ASSERT_TRUE(sketch.runs()) << sketch.said();
    const ForeignSpinner thief{kCore, 95, kSpin};
    ASSERT_TRUE(thief.spins()) << thief.core_error() << ", " << thief.priority_error();
    sketch.kill_sketch();
    EXPECT_TRUE(ends_while_spun_on(sketch, thief)) << sketch.said();
    EXPECT_THAT(sketch.said(),
                HasSubstr("it died of signal 9 (Killed); meanwhile core 1 was taken by core-thief "
                          "(pid " +
                          std::to_string(thief.pid()) + ", SCHED_FIFO 95)"));
    // The next sketch is refused, and it is not the last one's fault.
    const auto lock = CoreLock::take(kCore, 0s);
    ASSERT_FALSE(lock.ok());
    EXPECT_THAT(
        std::string{lock.error().message.view()},
        HasSubstr("core 1 is taken: core-thief (pid " + std::to_string(thief.pid()) + ", SCHED_FIFO 95)"));
    EXPECT_TRUE(thief.lives()) << "all of this was while it spun";
}

TEST_F(Dying, ASketchWithACoreOfItsOwnDiesAndTheSettingsComeBack) {
    const auto before = HostSnapshot::take();
    {
        TrainUnderSupervisor sketch{true};
        ASSERT_TRUE(sketch.runs()) << sketch.said();
        const std::string set = "/sys/fs/cgroup/cpuset/qduino-core1/tasks";
        if (!std::filesystem::exists(set)) GTEST_SKIP() << "no cpusets of the first version here";
        const ForeignSpinner thief{kCore, 95, kSpin, set};
        ASSERT_TRUE(thief.spins()) << thief.core_error() << ", " << thief.priority_error();
        sketch.kill_sketch();
        EXPECT_TRUE(ends_while_spun_on(sketch, thief)) << sketch.said();
        EXPECT_EQ(text_of_file(kDefaultSettingsState), "") << "nothing is left to undo";
        EXPECT_TRUE(thief.lives()) << "all of this was while it spun";
    }
    EXPECT_EQ(HostSnapshot::take().changes_since(before), "");
}

TEST_F(Dying, AKilledHolderOfACoreIsNotBlamed) {
    // Without a supervisor: it cannot die, and has the core.
    const pid_t test = ::getpid();
    const pid_t sketch = ::fork();
    if (sketch == 0) {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (::getppid() != test) ::_exit(1);
        name_thread("first owner");
        const auto held = CoreLock::take(kCore, 0s);
        if (!held || !pin_to_core(kCore) || !become_real_time(10)) ::_exit(1);
        for (;;) ::pause();
    }
    // Its priority is the last thing that it takes.
    while ((::sched_getscheduler(sketch) & ~SCHED_RESET_ON_FORK) != SCHED_FIFO) {
        ASSERT_EQ(::waitpid(sketch, nullptr, WNOHANG), 0) << "it could not take the core";
        std::this_thread::sleep_for(5ms);
    }
    {
        const ForeignSpinner thief{kCore, 95, 3s};
        ASSERT_TRUE(thief.spins()) << thief.core_error() << ", " << thief.priority_error();
        ::kill(sketch, SIGKILL);
        const auto lock = CoreLock::take(kCore, 0s);
        ASSERT_FALSE(lock.ok());
        EXPECT_THAT(std::string{lock.error().message.view()},
                    HasSubstr("first owner (pid " + std::to_string(sketch) +
                              ") was killed and cannot end, because "
                              "core-thief (pid " +
                              std::to_string(thief.pid()) + ", SCHED_FIFO 95) runs"));
    }
    ::waitpid(sketch, nullptr, 0);
}

}  // namespace
}  // namespace qduino::board::linux::test::dying_test
