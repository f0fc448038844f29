// The heat goes off, too, when the supervisor is hindered, frozen or dead; and no process spins
// meanwhile.
#include <sched.h>
#include <sys/prctl.h>

#include <filesystem>

#include "tests/scenario/supervisor/supervised_sketch.h"
#include "tests/unit/linux/fake_machine.h"

namespace qduino::board::linux::test::heat_watch_test {
namespace {

/// A supervisor that is hindered in the way that `hook` says (hooked_supervisor.cpp).
std::vector<std::string> hooked(const std::string& hook) { return {HOOKED_SUPERVISOR, hook}; }

/// What a hooked supervisor has written at its end.
struct HookReport {
    HookReport() { ::setenv("REPORT", file_.path().c_str(), 1); }
    ~HookReport() { ::unsetenv("REPORT"); }
    HookReport(const HookReport&) = delete;
    HookReport& operator=(const HookReport&) = delete;
    void read() { std::ifstream{file_.path()} >> polls >> seconds >> policy; }

    long polls = 0;
    double seconds = 0;
    int policy = -1;

  private:
    TemporaryPins file_;
};

bool is_real_time(pid_t process) {
    const int policy = ::sched_getscheduler(process);
    return policy >= 0 && (policy & ~SCHED_RESET_ON_FORK) == SCHED_FIFO;
}

/// For people: printed, and asserted with much room, for the machine may be busy.
void expect_soon(const char* what, Nanoseconds late, Nanoseconds limit) {
    std::printf("the heat was off %.2f ms after %s\n", to_seconds(late) * 1e3, what);
    EXPECT_LT(late, limit) << what;
}

TEST(HeatWatch, ThePinsAreSafeAndTheLinkIsMarkedThoughTheReapingNeverEnds) {
    const TemporaryLink link{0};
    SupervisedSketch run{"live", {"--link", link.path()}, hooked("reap-blocks")};
    run.wait_until_running();
    const Instant killed = monotonic_now();
    run.signal_sketch(SIGKILL);
    run.wait_for("heat off", [&] { return run.heat_is_off(); });
    // The design: 100 ms.
    expect_soon("the kill, the reaping blocked", monotonic_now() - killed, 1s);
    run.wait_for("the death note", [&] { return !link.note().empty(); });
    EXPECT_EQ(link.dead(), 1u);
    EXPECT_NE(link.note().find("signal 9"), std::string::npos) << link.note();
    run.wait_for("ordinary priority before the reaping", [&] { return !is_real_time(run.supervisor()); });
    run.kill_supervisor();
    run.finish();
    expect_safe(run.machine());
}

class ALoopOfTheSupervisor : public ::testing::TestWithParam<const char*> {};

TEST_P(ALoopOfTheSupervisor, DoesNotSpinWhateverItsCallsAnswerAndSeesTheDeathAllTheSame) {
    HookReport report;
    SupervisedSketch run{"live", {}, hooked(GetParam())};
    run.wait_until_running();
    std::this_thread::sleep_for(500ms);
    run.signal_sketch(SIGKILL);
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    expect_safe(run.machine());
    report.read();
    ASSERT_GT(report.seconds, 0.5);
    EXPECT_GT(report.polls, 10);
    EXPECT_LT(static_cast<double>(report.polls) / report.seconds, 1100) << "a turn begins every ms at most";
}
INSTANTIATE_TEST_SUITE_P(All, ALoopOfTheSupervisor,
                         ::testing::Values("poll-invalid", "poll-broken", "signal-broken"));

TEST(HeatWatch, ASketchThatNoSignalReachesIsKeptSafeUntilOneDoes) {
    SupervisedSketch run{"hang", {}, hooked("kill-fails")};
    run.wait_until_running();
    run.wait_for("heat off", [&] { return run.heat_is_off(); });
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    expect_safe(run.machine());
    EXPECT_EQ(run.death(), SketchDeath::hung);
}

TEST(HeatWatch, ASupervisorThatSpendsItsBudgetGoesOnAsAnOrdinaryProcess) {
    HookReport report;
    SupervisedSketch run{"live", {}, hooked("spins")};
    run.wait_until_running();
    if (!is_real_time(run.heat_watch())) {
        run.signal_sketch(SIGKILL);
        run.finish();
        GTEST_SKIP() << "needs real-time priority: run as root";
    }
    run.wait_for("ordinary priority", [&] { return !is_real_time(run.supervisor()); });
    run.signal_sketch(SIGKILL);
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    expect_safe(run.machine());
    report.read();
    EXPECT_EQ(report.policy, SCHED_OTHER) << "after 300 ms of spinning";
}

TEST(HeatWatch, AFrozenSupervisorsHeatIsCut) {
    const TemporaryLink link{0};
    SupervisedSketch run{"live", {"--link", link.path()}};
    run.wait_until_running();
    const bool real_time = is_real_time(run.heat_watch());
    const Instant frozen = monotonic_now();
    ::kill(run.supervisor(), SIGSTOP);
    run.wait_for("heat off", [&] { return run.heat_is_off(); });
    expect_soon("the supervisor froze", monotonic_now() - frozen, 2s);  // the design: 1 s
    run.wait_for("the death note", [&] { return !link.note().empty(); });
    EXPECT_EQ(link.dead(), 2u);
    EXPECT_NE(link.note().find("fell silent"), std::string::npos) << link.note();
    EXPECT_FALSE(is_real_time(run.supervisor())) << "it might be spinning";
    // It has stepped down for its words, and goes on as before.
    run.wait_for("the watch", [&] { return is_real_time(run.heat_watch()) == real_time; });
    ::kill(run.supervisor(), SIGCONT);
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    expect_safe(run.machine());
}

TEST(HeatWatch, ADeadSketchThatAFrozenSupervisorLetsLieIsMadeSafe) {
    SupervisedSketch run{"live"};
    run.wait_until_running();
    ::kill(run.supervisor(), SIGSTOP);
    const Instant killed = monotonic_now();
    run.signal_sketch(SIGKILL);
    run.wait_for("heat off", [&] { return run.heat_is_off(); });
    expect_soon("the kill, the supervisor frozen", monotonic_now() - killed, 1s);
    ::kill(run.supervisor(), SIGCONT);
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    expect_safe(run.machine());
}

/// What it adopts it also buries: whatever the supervisor leaves behind comes to this test.
class Orphanage {
  public:
    Orphanage() { ::prctl(PR_SET_CHILD_SUBREAPER, 1); }
    ~Orphanage() { ::prctl(PR_SET_CHILD_SUBREAPER, 0); }
    Orphanage(const Orphanage&) = delete;
    Orphanage& operator=(const Orphanage&) = delete;
    /// Waits for the end of `process`.
    static void bury(pid_t process) {
        SupervisedSketch::wait_for("the end of an orphan",
                                   [=] { return ::waitpid(process, nullptr, WNOHANG) == process; });
    }
};

TEST(HeatWatch, WhenTheSupervisorIsKilledTheHeatIsCutAndNothingIsLeft) {
    const Orphanage orphanage;
    const TemporaryLink link{0};
    // No SIGTERM ends it in order: only the watch can.
    SupervisedSketch run{"deaf", {"--link", link.path()}};
    run.wait_for_pin(11);
    const pid_t sketch = run.sketch(), watch = run.heat_watch();
    ASSERT_GT(watch, 0);
    const Instant killed = monotonic_now();
    run.kill_supervisor();
    run.wait_for("heat off", [&] { return run.heat_is_off(); });
    expect_soon("the supervisor's death", monotonic_now() - killed, 1s);
    orphanage.bury(watch);
    orphanage.bury(sketch);
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    expect_safe(run.machine());
    EXPECT_EQ(run.death(), SketchDeath::hung);
    EXPECT_NE(link.note().find("supervisor died"), std::string::npos) << link.note();
}

TEST(HeatWatch, WhenSupervisorAndSketchAreKilledTogetherTheHeatIsCut) {
    const Orphanage orphanage;
    SupervisedSketch run{"live"};
    run.wait_until_running();
    const pid_t sketch = run.sketch(), watch = run.heat_watch();
    ASSERT_GT(watch, 0);
    const Instant killed = monotonic_now();
    run.kill_supervisor();
    run.signal_sketch(SIGKILL);
    run.wait_for("heat off", [&] { return run.heat_is_off(); });
    expect_soon("both deaths", monotonic_now() - killed, 1s);
    orphanage.bury(watch);
    orphanage.bury(sketch);
    run.finish();
    expect_safe(run.machine());
}

TEST(HeatWatch, WhenSupervisorAndWatchAreKilledTheSketchStopsInOrder) {
    const Orphanage orphanage;
    SupervisedSketch run{"live"};
    run.wait_until_running();
    const pid_t sketch = run.sketch(), watch = run.heat_watch();
    ASSERT_GT(watch, 0);
    ::kill(watch, SIGKILL);
    run.kill_supervisor();
    orphanage.bury(sketch);
    ::waitpid(watch, nullptr, WNOHANG);  // the supervisor may have buried it already
    run.finish();
    expect_safe(run.machine());
}

TEST(HeatWatch, AKilledWatchIsReplacedAndBuried) {
    SupervisedSketch run{"live"};
    run.wait_until_running();
    const pid_t first = run.heat_watch();
    ASSERT_GT(first, 0);
    ::kill(first, SIGKILL);
    pid_t second = 0;
    run.wait_for("another watch", [&] {
        second = run.heat_watch();
        return second > 0 && second != first;
    });
    EXPECT_NE(::kill(first, 0), 0) << "it lies unburied";
    EXPECT_FALSE(run.heat_is_off()) << "the sketch goes on";
    run.signal_sketch(SIGKILL);
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    expect_safe(run.machine());
    EXPECT_NE(::kill(second, 0), 0) << "a clean end ends the watch";
}

/// Two channels of pwmchip0, as files.
class PwmMachine {
  public:
    PwmMachine() {
        for (const char* channel : {"2", "3"}) {
            for (const char* file : {"duty_cycle", "period", "enable"})
                std::ofstream{made(std::string{kChip} + channel + "/" + file)}.flush();
        }
    }
    [[nodiscard]] std::string root() const { return machine_.root(); }
    [[nodiscard]] std::string path(int channel, const char* file) const {
        return machine_.path(kChip + std::to_string(channel) + "/" + file);
    }
    /// −1: nothing was written.
    [[nodiscard]] long value(int channel, const char* file) const {
        long value = -1;
        std::ifstream{path(channel, file)} >> value;
        return value;
    }

  private:
    static constexpr const char* kChip = "/sys/class/pwm/pwmchip0/pwm";
    std::string made(const std::string& file) {
        machine_.put(file, "");
        return machine_.path(file);
    }
    FakeMachine machine_;
};

/// Until the heater on its channel is on.
void wait_until_hot(SupervisedSketch& run, const PwmMachine& pwm) {
    run.wait_until_running();
    ASSERT_FALSE(run.gone()) << "the sketch has come to its end already";
    EXPECT_EQ(pwm.value(2, "duty_cycle"), 500'000);
    EXPECT_EQ(pwm.value(2, "enable"), 1);
}

void expect_safe_channels(const PwmMachine& pwm) {
    EXPECT_EQ(pwm.value(2, "duty_cycle"), 0);
    EXPECT_EQ(pwm.value(3, "duty_cycle"), 1'000'000);
}

TEST(HeatWatch, AHeaterOnAPwmChannelIsSwitchedOffWhenTheSketchIsKilled) {
    const PwmMachine pwm;
    SupervisedSketch run{"live", {}, {SUPERVISOR}, pwm.root()};
    wait_until_hot(run, pwm);
    run.signal_sketch(SIGKILL);
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    expect_safe_channels(pwm);
    expect_safe(run.machine());
}

TEST(HeatWatch, AHeaterOnAPwmChannelIsSwitchedOffWhenTheSupervisorIsKilled) {
    const Orphanage orphanage;
    const PwmMachine pwm;
    SupervisedSketch run{"deaf", {}, {SUPERVISOR}, pwm.root()};  // as above
    wait_until_hot(run, pwm);
    run.wait_for_pin(11);
    const pid_t sketch = run.sketch(), watch = run.heat_watch();
    run.kill_supervisor();
    orphanage.bury(watch);
    orphanage.bury(sketch);
    run.finish();
    expect_safe_channels(pwm);
}

TEST(HeatWatch, AChannelThatTakesNoDutyIsSwitchedOffAltogether) {
    const PwmMachine pwm;
    SupervisedSketch run{"live", {}, {SUPERVISOR}, pwm.root()};
    wait_until_hot(run, pwm);
    std::filesystem::remove(pwm.path(2, "duty_cycle"));
    run.signal_sketch(SIGKILL);
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    EXPECT_EQ(pwm.value(2, "enable"), 0);
}

}  // namespace
}  // namespace qduino::board::linux::test::heat_watch_test
