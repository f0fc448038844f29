// A kernel thread that does bottom halves and wants all of its core, on the budget of an I/O VCPU.
//
// A computer whose interrupts are not threaded has no such thread. So a process of the test's own
// stands for it, in a tree that looks like /proc and /sys: the board ranks it, charges it and takes
// its priority by the same system calls as a kernel thread's. It would take the core for two
// seconds, and is then ended by its own limit. How often it has its priority is sampled.
#include <gtest/gtest.h>
#include <linux/capability.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <utility>

#include "base/whole_number.h"
#include "board/linux/computer/core_promises.h"
#include "board/linux/kernel/host_settings.h"
#include "board/linux/kernel/kernel_text.h"
#include "board/linux/kernel/real_time_thread.h"
#include "board/linux/linux_board.h"
#include "tests/unit/linux/fake_machine.h"

namespace qduino::board::linux::test::bottom_half_test {
namespace {

constexpr VcpuId kIo = kFirstIoVcpu;

/// A batch process that spins on core 0, and ends with its parent.
class Spinner {
  public:
    Spinner() : pid_(::fork()) {
        if (pid_ != 0) return;
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        const rlimit real_time{2'000'000, 2'000'000};
        ::setrlimit(RLIMIT_RTTIME, &real_time);
        for (;;) {
        }
    }
    ~Spinner() {
        ::kill(pid_, SIGKILL);
        ::waitpid(pid_, nullptr, 0);
    }
    Spinner(const Spinner&) = delete;
    Spinner& operator=(const Spinner&) = delete;

    [[nodiscard]] pid_t pid() const { return pid_; }
    [[nodiscard]] int policy() const { return ::sched_getscheduler(pid_) & ~SCHED_RESET_ON_FORK; }

  private:
    pid_t pid_;
};

class AGreedyBottomHalf : public ::testing::Test {
  protected:
    void SetUp() override {
        if (!has_capability(CAP_SYS_NICE)) GTEST_SKIP() << "needs a right to real-time priorities";
        const sched_param none{};
        ASSERT_EQ(::sched_setscheduler(thread.pid(), SCHED_BATCH, &none), 0);
        machine.put("/proc/irq/40/smp_affinity_list", "0-1");
        machine.put("/sys/kernel/irq/40/actions", "eth0-rx");
        serve_by(thread.pid());
    }
    /// Thread `tid` of this computer does the bottom halves.
    void serve_by(pid_t tid) { machine.put("/proc/" + std::to_string(tid) + "/comm", "irq/40-eth0-rx"); }

    /// A loop and an I/O VCPU of 1 ms in 10, on core 0. The loop, which comes before the other,
    /// calls `look` every millisecond or two.
    GuaranteeReport run(Nanoseconds length, const std::function<void(LinuxBoard&)>& look) {
        LinuxConfig config;
        config.sysfs_root = machine.root();
        config.settings_state = machine.state();
        config.lock_memory = config.handle_signals = false;
        config.probe_duration = Nanoseconds{0};
        auto opened = LinuxBoard::open(config);
        EXPECT_TRUE(opened.ok());
        LinuxBoard& board = **opened;
        EXPECT_TRUE(board.serve_interrupts(DeviceClass::nic, kIo).ok());
        std::function<void()> body = [&] {
            for (; !board.stop_requested(); board.sleep_until(board.now() + 1ms)) look(board);
        };
        VcpuSpec loop, io;
        static_cast<sched::Vcpu&>(loop) = {.id = 1, .budget = 1ms, .period = 10ms, .core = 0};
        loop.entry = [](void* function) { (*static_cast<std::function<void()>*>(function))(); };
        loop.context = &body;
        static_cast<sched::Vcpu&>(io) = {
            .id = kIo, .budget = 1ms, .period = 10ms, .core = 0, .kind = VcpuKind::io};
        io.client_period = 10ms;
        EXPECT_TRUE(board.start(std::array{loop, io}).ok());
        board.run(board.now() + length);
        board.request_stop();
        board.run(kForever);
        if (const auto promises = PromiseRegister::open(machine.root())) promised = promises->living();
        return board.guarantee();
    }

    Spinner thread;
    FakeMachine machine;
    std::vector<Promise> promised;  // to other programs, at the end of the run
};

TEST_F(AGreedyBottomHalf, HasItsPriorityForItsShareOfTheTime) {
    int looks = 0, ranked = 0;
    const GuaranteeReport report = run(2s, [&](LinuxBoard&) {
        ++looks;
        ranked += thread.policy() == SCHED_FIFO ? 1 : 0;
    });
    const LoopGuarantee& io = report.loops[1];
    EXPECT_EQ(io.kernel_threads, 1u);
    EXPECT_GT(io.kernel_held, 5u) << to_ns(io.kernel_used);
    EXPECT_GT(io.kernel_used, Nanoseconds{0});
    // A tenth; two services and looks at either end; and looks that come late on a busy computer.
    EXPECT_LE(io.kernel_used, 250ms);
    EXPECT_LE(ranked, looks / 4) << looks;
    EXPECT_GT(ranked, 0);
    EXPECT_EQ(io.escape.view(), "") << "it is no loop that escaped";
    EXPECT_EQ(thread.policy(), SCHED_BATCH) << "as before";
}

TEST_F(AGreedyBottomHalf, HasTheShareThatItsVcpuIsGiven) {
    bool raised = false;
    const GuaranteeReport report = run(2s, [&](LinuxBoard& board) {
        if (!std::exchange(raised, true)) {
            EXPECT_TRUE(board.change_io(kIo, {8ms, 10ms}).ok());
        }
    });
    EXPECT_GE(report.loops[1].kernel_used, 600ms) << "three times what it had, at the least";
    EXPECT_EQ(report.loops[1].budget, 8ms);
    ASSERT_EQ(promised.size(), 1u);
    EXPECT_GE(promised[0].vcpus[1].budget, 8ms) << "and what an activation costs";
}

/// The first thread of this computer's kernel that serves an interrupt; 0: there is none.
pid_t kernel_thread() {
    for (const std::string& entry : entries("/proc")) {
        if (text_of_file("/proc/" + entry + "/comm").starts_with("irq/"))
            return whole_number<pid_t>(entry).value_or(0);
    }
    return 0;
}

/// Where this kernel has a threaded interrupt, if only a quiet one: beside the greedy process.
TEST_F(AGreedyBottomHalf, SharesItsBudgetWithAThreadOfTheRealKernel) {
    const pid_t kernels = kernel_thread();
    if (kernels == 0) GTEST_SKIP() << "this kernel has no threaded interrupt";
    serve_by(kernels);
    const int policy = ::sched_getscheduler(kernels);
    sched_param before{}, after{};
    ::sched_getparam(kernels, &before);
    int ranked = 0, held = 0;
    const GuaranteeReport report = run(500ms, [&](LinuxBoard&) {
        sched_param now{};
        ::sched_getparam(kernels, &now);
        ++(now.sched_priority > before.sched_priority ? ranked : held);
    });
    EXPECT_EQ(report.loops[1].kernel_threads, 2u);
    EXPECT_GT(ranked, 0);
    EXPECT_GT(held, ranked) << "they have one budget, which the other one spends";
    EXPECT_EQ(::sched_getscheduler(kernels), policy);
    ::sched_getparam(kernels, &after);
    EXPECT_EQ(after.sched_priority, before.sched_priority);
}

TEST_F(AGreedyBottomHalf, IsAsBeforeThoughItsSketchIsKilledWhileItIsHeld) {
    const pid_t sketch = ::fork();
    if (sketch == 0) {
        run(2s, [&](LinuxBoard&) {
            if (thread.policy() == SCHED_OTHER) ::raise(SIGKILL);
        });
        ::_exit(0);
    }
    int status = 0;
    ::waitpid(sketch, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status)) << "it was never held";
    ASSERT_TRUE(restore_settings(machine.state()).ok());
    EXPECT_EQ(thread.policy(), SCHED_BATCH);
}

}  // namespace
}  // namespace qduino::board::linux::test::bottom_half_test
