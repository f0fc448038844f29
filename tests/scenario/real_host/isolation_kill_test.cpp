// kill -9 of a sketch that has, or is about to have, a core of the real computer for itself:
// whenever it comes, every changed setting is put back. For root; it moves everything off the last
// core for a moment.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <random>
#include <thread>

#include "board/linux/kernel/host_settings.h"
#include "board/linux/kernel/real_time_thread.h"
#include "posix/small_file.h"
#include "posix/unique_fd.h"
#include "tests/unit/linux/host_snapshot.h"

namespace qduino::board::linux::test::isolation_kill_test {

using posix::read_small_file;
using posix::UniqueFd;
namespace {

using namespace std::chrono_literals;

/// The pulse train, which owns core 1, with --isolate; what it says comes through a pipe.
class IsolatedSketch {
  public:
    IsolatedSketch() {
        int ends[2];
        if (::pipe2(ends, O_CLOEXEC) != 0) return;
        said_ = UniqueFd{ends[0]};
        const UniqueFd to_say{ends[1]};
        pid_ = ::fork();
        if (pid_ != 0) return;
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // it must not keep its core when this test is stopped
        ::dup2(to_say.get(), STDOUT_FILENO);
        ::dup2(to_say.get(), STDERR_FILENO);
        ::execl(ISOLATED_SKETCH, ISOLATED_SKETCH, "--isolate", "--for", "20", nullptr);
        ::_exit(126);
    }
    ~IsolatedSketch() { kill(); }
    IsolatedSketch(const IsolatedSketch&) = delete;
    IsolatedSketch& operator=(const IsolatedSketch&) = delete;

    /// Waits until it has recorded its first change to the machine, or has ended.
    void wait_for_a_change() const {
        const auto recorded = [] {
            const auto text = read_small_file(kDefaultSettingsState);
            return text && text->find("\nwrite\t") != std::string::npos;
        };
        while (!recorded() && lives()) std::this_thread::sleep_for(200us);
    }
    /// Waits for its guarantee report: its loop runs then.
    void wait_for_its_report() const {
        std::string text;
        char byte = 0;
        while (text.find("What holds") == std::string::npos && text.size() < 20'000 &&
               ::read(said_.get(), &byte, 1) == 1)
            text += byte;
    }
    void kill() {
        if (pid_ <= 0) return;
        ::kill(pid_, SIGKILL);
        ::waitpid(pid_, nullptr, 0);
        pid_ = -1;
    }

  private:
    [[nodiscard]] bool lives() const {
        siginfo_t info{};
        return ::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
               info.si_pid == 0;
    }

    UniqueFd said_;
    pid_t pid_ = -1;
};

enum class Moment { before, during, after };

class AKill : public ::testing::TestWithParam<Moment> {};

TEST_P(AKill, OfAnIsolatedSketchLeavesAMachineThatRestorePutsBack) {
    if (::geteuid() != 0 || cpu_count() < 2) GTEST_SKIP() << "needs root and two cores";
    if (::access("/proc/irq/default_smp_affinity", W_OK) != 0)
        GTEST_SKIP() << "nothing can be isolated here: /proc/irq is not ours to change";
    {
        // And undoes what an earlier one left.
        const auto mine = HostSettings::open(kDefaultSettingsState);
        if (!mine.ok()) GTEST_SKIP() << mine.error().message.view();
    }
    const auto seed = static_cast<unsigned>(std::random_device{}());
    std::mt19937 random{seed};
    SCOPED_TRACE("seed " + std::to_string(seed));
    const auto before = HostSnapshot::take();
    ASSERT_GT(before.size(), 20u);
    for (int round = 0; round < 3; ++round) {
        IsolatedSketch sketch;
        if (GetParam() == Moment::during) sketch.wait_for_a_change();
        if (GetParam() == Moment::after) {
            sketch.wait_for_its_report();
            EXPECT_NE(HostSnapshot::take().changes_since(before), "") << "nothing was isolated";
        }
        std::this_thread::sleep_for(std::chrono::microseconds{random() % 20'000});
        sketch.kill();
        const auto restored = restore_settings(kDefaultSettingsState);
        ASSERT_TRUE(restored.ok()) << restored.error().message.view();
        if (GetParam() != Moment::before) {
            EXPECT_EQ(*restored, Restored::undone);
        }
        EXPECT_EQ(HostSnapshot::take().changes_since(before), "");
        EXPECT_EQ(*restore_settings(kDefaultSettingsState), Restored::nothing_to_do);
    }
}

INSTANTIATE_TEST_SUITE_P(Isolation, AKill, ::testing::Values(Moment::before, Moment::during, Moment::after),
                         [](const auto& tested) {
                             const Moment moment = tested.param;
                             return std::string(moment == Moment::before   ? "Before"
                                                : moment == Moment::during ? "During"
                                                                           : "After");
                         });

}  // namespace
}  // namespace qduino::board::linux::test::isolation_kill_test
