// The warden and the filter of system calls, on loops without real-time priorities: any user can
// run these. (tests/scenario/real_host has the same with priorities, judged from outside.)
#include "board/linux/warden.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <functional>
#include <memory>
#include <utility>

#include "board/linux/clock.h"
#include "board/linux/linux_board.h"

namespace qduino::board::linux::test::warden_test {
namespace {

using Body = std::function<void()>;

VcpuSpec loop_of(VcpuId id, Body& body) {
    VcpuSpec spec;
    spec.id = id;
    spec.budget = 2ms;
    spec.period = 20ms;
    spec.core = 0;
    spec.entry = [](void* function) { (*static_cast<Body*>(function))(); };
    spec.context = &body;
    return spec;
}

/// Two loops of 2 ms in 20 ms, one of which does nothing.
class Wards : public ::testing::Test {
  protected:
    Wards() {
        LinuxConfig config;
        config.real_time = config.lock_memory = config.handle_signals = false;
        auto opened = LinuxBoard::open(config);
        board_ = std::move(*opened);
    }
    GuaranteeReport run(Body body, Nanoseconds length, bool classic = false) {
        Body idle = [&] {
            while (!board_->stop_requested()) board_->sleep_until(board_->now() + 20ms);
        };
        std::array specs{loop_of(1, body), loop_of(2, idle)};
        specs[0].classic = classic;
        EXPECT_TRUE(board_->start(specs).ok());
        board_->run(board_->now() + length);
        board_->request_stop();
        board_->run(kForever);
        return board_->guarantee();
    }
    LinuxBoard& board() { return *board_; }

  private:
    std::unique_ptr<LinuxBoard> board_;
};

TEST_F(Wards, ALoopThatBlocksItsSignalsIsKeptToItsBudgetFromOutside) {
    Nanoseconds used{};
    const Instant begun = monotonic_now();
    const GuaranteeReport report = run(
        [&] {
            sigset_t all;
            sigfillset(&all);
            ::pthread_sigmask(SIG_BLOCK, &all, nullptr);
            while (!board().stop_requested()) {
            }
            used = thread_cpu_time();
        },
        600ms);
    const Nanoseconds took = monotonic_now() - begun;
    if (report.loops[0].shortfall.view().find("ptrace") != std::string_view::npos)
        GTEST_SKIP() << "threads cannot be stopped here";
    // Its budgets, what the watch is patient with, and looks that come late on a busy computer.
    EXPECT_LE(used, took / 10 + 40ms);
    if (used < took / 10) return;  // so busy that it never got its budget
    EXPECT_FALSE(report.loops[0].budget_enforced);
    EXPECT_GT(report.loops[0].held, 0u);
    EXPECT_NE(report.loops[0].escape.view().find("blocks the signal"), std::string_view::npos);
    EXPECT_EQ(report.loops[1].escape.view(), "");
}

TEST_F(Wards, ALoopMayNeitherMakeOthersNorMoveNorRankItself) {
    std::array<int, 3> errors{};
    run(
        [&] {
            const pid_t child = ::fork();
            if (child == 0) ::_exit(0);
            errors[0] = errno;
            const sched_param ordinary{};
            errors[1] = ::sched_setscheduler(0, SCHED_BATCH, &ordinary) == 0 ? 0 : errno;
            cpu_set_t cores;
            CPU_ZERO(&cores);
            CPU_SET(0, &cores);
            errors[2] = ::sched_setaffinity(0, sizeof cores, &cores) == 0 ? 0 : errno;
        },
        1ms);
    if (errors[1] == 0) GTEST_SKIP() << "this kernel filters no system calls";
    EXPECT_EQ(errors, (std::array{EAGAIN, EPERM, EPERM}));
}

TEST_F(Wards, TheClassicLoopMayStartAProcess) {
    int status = -1;
    run(
        [&] {
            const pid_t child = ::fork();
            if (child == 0) ::_exit(7);
            ::waitpid(child, &status, 0);
        },
        1ms, true);
    EXPECT_EQ(WEXITSTATUS(status), 7);
}

TEST_F(Wards, TheSketchsOwnWaitDoesNotSeeTheWarden) {
    int error = 0;
    run([&] { error = ::waitpid(-1, nullptr, WNOHANG) < 0 ? errno : 0; }, 1ms);
    EXPECT_EQ(error, ECHILD);
}

TEST(Warden, ThatWasKilledWatchesNoMore) {
    Warden warden;
    ASSERT_TRUE(warden.hire({}).ok());
    ASSERT_TRUE(warden.watch({}, {}, 0).ok());
    EXPECT_TRUE(warden.watches());
    ::kill(warden.pid(), SIGKILL);
    while (warden.watches()) block_until(monotonic_now() + 1ms);
    warden.dismiss();
    EXPECT_EQ(warden.pid(), 0);
}

}  // namespace
}  // namespace qduino::board::linux::test::warden_test
