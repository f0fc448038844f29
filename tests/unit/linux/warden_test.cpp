// The warden and the filter of system calls, on loops without real-time priorities: any user can
// run these. (tests/scenario/real_host has the same with priorities, judged from outside.)
#include "board/linux/loop/warden.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/sockios.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/written_files.h"
#include "board/linux/linux_board.h"
#include "board/linux/loop/strangers.h"

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
        ended_early_ = board_->stop_requested();
        board_->request_stop();
        board_->run(kForever);
        return board_->guarantee();
    }
    LinuxBoard& board() { return *board_; }
    /// Before its time was over.
    [[nodiscard]] bool ended_early() const { return ended_early_; }
    /// The child of this process that is called "warden"; 0: there is none.
    static pid_t warden() {
        const std::string self = std::to_string(::getpid());
        std::ifstream children{"/proc/" + self + "/task/" + self + "/children"};
        for (pid_t child = 0; children >> child;) {
            std::string name;
            std::getline(std::ifstream{"/proc/" + std::to_string(child) + "/comm"}, name);
            if (name == "warden") return child;
        }
        return 0;
    }

  private:
    bool ended_early_ = false;
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

/// What the kernel would do to the warden for a loop that asks it.
TEST_F(Wards, ALoopCannotHaveTheKernelReachItsWarden) {
    std::map<std::string, int> errors;
    const auto note = [&](const char* what, long answer) { errors[what] = answer < 0 ? errno : 0; };
    run(
        [&] {
            const pid_t victim = warden();
            const std::string folder = "/proc/" + std::to_string(victim);
            int ends[2];
            if (victim == 0 || ::pipe(ends) != 0) return;
            note("F_SETOWN", ::fcntl(ends[0], F_SETOWN, victim));
            f_owner_ex owner{F_OWNER_PID, victim};
            note("F_SETOWN_EX", ::fcntl(ends[0], F_SETOWN_EX, &owner));
            note("F_SETSIG", ::fcntl(ends[0], F_SETSIG, SIGKILL));
            note("FIOSETOWN", ::ioctl(ends[0], FIOSETOWN, &victim));
            note("kill", ::kill(victim, SIGKILL));
            note("kill of its group", ::kill(-victim, SIGKILL));
            note("pidfd_open", ::syscall(SYS_pidfd_open, victim, 0));
            note("ptrace", ::ptrace(PTRACE_SEIZE, victim, nullptr, nullptr));
            char byte = 0;
            iovec piece{&byte, 1};
            note("process_vm_writev", ::process_vm_writev(victim, &piece, 1, &piece, 1, 0));
            note("mem", ::open((folder + "/mem").c_str(), O_RDWR));
            note("io_uring_setup", ::syscall(SYS_io_uring_setup, 4, nullptr));
            note("userfaultfd", ::syscall(SYS_userfaultfd, 0));
            note("perf_event_open", ::syscall(SYS_perf_event_open, nullptr, 0, -1, -1, 0));
            note("timerfd_settime", ::syscall(SYS_timerfd_settime, -1, 0, nullptr, nullptr));
            note("PR_SET_DUMPABLE", ::prctl(PR_SET_DUMPABLE, 0));
            const rlimit none{0, 0};
            note("RLIMIT_SIGPENDING", ::setrlimit(RLIMIT_SIGPENDING, &none));
        },
        1ms);
    if (errors.empty() || errors["kill"] == 0) GTEST_SKIP() << "this kernel filters no system calls";
    for (const auto& [what, error] : errors) {
        if (what == "mem") {
            EXPECT_TRUE(error == EACCES || error == EPERM) << error;
        } else {
            EXPECT_EQ(error, EPERM) << what;
        }
    }
    EXPECT_EQ(errors.size(), 16u);
}

TEST_F(Wards, ALoopUsesDescriptorsAndLimitsAsEver) {
    std::array<long, 4> answers{};
    run(
        [&] {
            answers[0] = ::fcntl(STDERR_FILENO, F_GETFD);
            int bytes = 0;
            int ends[2];
            if (::pipe(ends) != 0) return;
            answers[1] = ::ioctl(ends[0], FIONREAD, &bytes);
            answers[2] = ::prctl(PR_GET_DUMPABLE);
            rlimit files{};
            answers[3] = ::getrlimit(RLIMIT_NOFILE, &files);
        },
        1ms);
    EXPECT_GE(answers[0], 0);
    EXPECT_EQ(answers[1], 0);
    EXPECT_GE(answers[2], 0);
    EXPECT_EQ(answers[3], 0);
}

/// Opened only, never written: the computer stays as it is also where this is not refused.
TEST_F(Wards, ALoopWritesNoFileOfTheKernels) {
    std::map<std::string, int> errors;
    const auto try_to_open = [&](const std::string& path) {
        const int file = ::open(path.c_str(), O_WRONLY);
        errors[path] = file < 0 ? errno : 0;
        if (file >= 0) ::close(file);
    };
    const std::string own = "/tmp/qduino-warden-test-" + std::to_string(::getpid());
    ::close(::open(own.c_str(), O_CREAT | O_WRONLY, 0600));
    std::string victims_score;
    run(
        [&] {
            victims_score = "/proc/" + std::to_string(warden()) + "/oom_score_adj";
            for (const std::string& path :
                 {own, std::string{"/dev/null"}, victims_score, std::string{"/proc/self/oom_score_adj"},
                  std::string{"/proc/sys/vm/drop_caches"},
                  std::string{"/sys/devices/system/cpu/cpu1/online"}})
                try_to_open(path);
        },
        1ms);
    ::unlink(own.c_str());
    EXPECT_EQ(errors[own], 0);
    EXPECT_EQ(errors["/dev/null"], 0);
    if (!rules_for_written_files()) GTEST_SKIP() << "no Landlock here";
    for (const auto& [path, error] : errors) {
        if (path == own || path == "/dev/null" || error == ENOENT) continue;
        EXPECT_EQ(error, EACCES) << path;
    }
}

TEST_F(Wards, ASketchWhoseWardenDiesIsToldToEnd) {
    std::jthread killer{[](const std::stop_token& stop) {
        pid_t victim = 0;
        while ((victim = warden()) == 0 && !stop.stop_requested()) block_until(monotonic_now() + 1ms);
        block_until(monotonic_now() + 300ms);  // it watches by then
        if (victim != 0) ::kill(victim, SIGKILL);
    }};
    const GuaranteeReport report = run(
        [&] {
            while (!board().stop_requested()) board().sleep_until(board().now() + 20ms);
        },
        60s);
    EXPECT_TRUE(ended_early());
    EXPECT_NE(report.watch_lost.view().find("the warden died"), std::string_view::npos)
        << report.watch_lost.view();
    EXPECT_FALSE(report.loops[0].budget_enforced);
    EXPECT_EQ(report.loops[0].escape.view(), "");
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

TEST(Warden, IsJudgedByItsBeatAndNotByItsPresence) {
    Warden warden;
    WardenTask task;
    task.priority = 1;  // where that is granted
    ASSERT_TRUE(warden.hire(task).ok());
    ASSERT_TRUE(warden.watch({}, {}, 0).ok());
    EXPECT_FALSE(warden.is_lost());
    EXPECT_EQ(warden.lapse().view(), "");
    ::kill(warden.pid(), SIGSTOP);
    while (!warden.is_lost()) block_until(monotonic_now() + 10ms);
    EXPECT_TRUE(warden.watches()) << "it is there";
    EXPECT_NE(warden.lapse().view().find("the warden has not looked for"), std::string_view::npos);
    ::kill(warden.pid(), SIGCONT);
    while (warden.is_lost()) block_until(monotonic_now() + 10ms);
    EXPECT_NE(warden.lapse().view().find("the warden did not look for"), std::string_view::npos)
        << "it was not there all along";
}

TEST(Warden, ItsFindingsCannotBeMadeWritable) {
    Warden warden;
    ASSERT_TRUE(warden.hire({}).ok());
    const auto page = reinterpret_cast<std::uintptr_t>(warden.findings()) & ~std::uintptr_t{4095};
    EXPECT_EQ(::mprotect(reinterpret_cast<void*>(page), 4096, PROT_READ | PROT_WRITE), -1);
    EXPECT_EQ(errno, EACCES);
}

// ---- threads in nobody's budget -----------------------------------------------------------------

TEST(TaskRank, IsReadFromTheFieldsBehindTheName) {
    const auto stat = [](int priority, int policy) {
        return text<std::string>("812 (a ) (b) S 1 812 812 0 -1 4194560 96 0 0 0 12 3 0 0 ", priority,
                                 " 0 4 0 91 9 2 18446744073709551615 1 1 0 0 0 0 0 0 0 0 0 0 17 1 40 ",
                                 policy, " 0 0 0 0 0 0\n");
    };
    const std::string ordinary = stat(20, SCHED_OTHER), ranked = stat(-81, SCHED_FIFO),
                      lent = stat(-81, SCHED_OTHER);
    EXPECT_EQ(task_rank(ordinary).name, "a ) (b");
    EXPECT_FALSE(task_rank(ordinary).lent() || task_rank(ordinary).ranked_itself());
    EXPECT_EQ(task_rank(ordinary).core, 1);
    EXPECT_TRUE(task_rank(ranked).ranked_itself());
    EXPECT_FALSE(task_rank(ranked).lent());
    EXPECT_TRUE(task_rank(lent).lent());
    EXPECT_EQ(task_rank(lent).priority(), 80);
    for (const char* broken : {"", "(", ")(", "1 (x", "1 (x)", "1 (x) S"}) {
        EXPECT_FALSE(task_rank(broken).lent() || task_rank(broken).ranked_itself()) << broken;
    }
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
