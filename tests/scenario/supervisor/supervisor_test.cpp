// However a sketch ends, its pins end in their safe states, and the print service learns of it.
#include <random>

#include "board/linux/pin/starter.h"
#include "tests/scenario/supervisor/supervised_sketch.h"

namespace qduino::board::linux::test::supervisor_test {
namespace {

/// When the machine saw the first pin forced: the heater's end.
Instant first_forced(const RecordingMachine& machine) {
    bool was_on = false;
    for (const Seen& event : machine.seen) {
        if (event.pin != 3 || event.pwm) continue;
        if (was_on && event.value == 0.0) return event.time;
        was_on = event.value != 0.0;
    }
    return kEpoch;
}

/// For people, and for the machine that the figure is of: printed, never asserted.
void say_how_late(const char* what, Nanoseconds late) {
    std::printf("the pins were forced %.2f ms after %s (the design's bound: 100 ms)\n",
                to_seconds(late) * 1e3, what);
}

TEST(Supervisor, SigkillOfTheSketch) {
    SupervisedSketch run{"live"};
    run.wait_until_running();
    const Instant killed = monotonic_now();
    run.signal_sketch(SIGKILL);
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    expect_safe(run.machine());
    EXPECT_EQ(run.death(), SketchDeath::died);
    say_how_late("the kill", first_forced(run.machine()) - killed);
}

TEST(Supervisor, SigkillOfTheSketchAtAnyMoment) {
    const auto seed = static_cast<std::uint64_t>(std::random_device{}());
    std::mt19937_64 random{seed};
    SCOPED_TRACE("seed " + std::to_string(seed));
    for (int round = 0; round < 8; ++round) {
        SupervisedSketch run{"live"};
        while (run.sketch() == 0) std::this_thread::yield();
        std::this_thread::sleep_for(std::chrono::microseconds{random() % 30'000});
        run.signal_sketch(SIGKILL);
        EXPECT_EQ(run.finish(), 128 + SIGKILL);
        const LastSeen last = last_seen(run.machine());
        // Whatever had been given a safe state by then is in it.
        for (const std::uint16_t pin : {3, 5}) {
            const int safe = run.layout().outputs[pin].safe.load();
            if (safe != 0) {
                EXPECT_EQ(last.level.at(pin), safe - 1.0) << "pin " << pin;
            }
        }
        if (run.layout().outputs[4].safe.load() != 0) {
            EXPECT_EQ(last.level.at(4), 0.0);
        }
    }
}

TEST(Supervisor, Segfault) {
    SupervisedSketch run{"segv"};
    const int status = run.finish();
    EXPECT_NE(status, 0);  // 128 + SIGSEGV, or a sanitizer's own status
    expect_safe(run.machine());
    EXPECT_EQ(run.death(), SketchDeath::died);
}

TEST(Supervisor, StackOverflow) {
    SupervisedSketch run{"overflow"};
    EXPECT_NE(run.finish(), 0);
    expect_safe(run.machine());
}

TEST(Supervisor, BrokenContract) {
    SupervisedSketch run{"contract"};
    EXPECT_EQ(run.finish(), 128 + SIGABRT);
    expect_safe(run.machine());
}

TEST(Supervisor, AnEndWithoutASignal) {
    SupervisedSketch run{"exit"};
    EXPECT_EQ(run.finish(), 7);
    expect_safe(run.machine());
    EXPECT_EQ(run.death(), SketchDeath::died);
}

TEST(Supervisor, AHangInOneLoopKillsTheSketchThoughTheOtherLoopGoesOn) {
    SupervisedSketch run{"hang"};
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    expect_safe(run.machine());
    EXPECT_EQ(run.death(), SketchDeath::hung);
    const Instant promised = instant_from_ns(run.layout().heartbeats[1].expected_by_ns.load());
    EXPECT_GT(first_forced(run.machine()), promised);  // not before the loop had broken its word
    say_how_late("the missed heartbeat", first_forced(run.machine()) - promised);
}

/// As Ctrl-Z and fg do, or a freezer: and the supervisor is the first that goes on.
TEST(Supervisor, AJobThatWasStoppedAsAWholeGoesOn) {
    SupervisedSketch run{"live"};
    run.wait_until_running();
    const pid_t heat_watch = run.heat_watch();
    ASSERT_GT(heat_watch, 0);
    run.signal_sketch(SIGSTOP);
    ::kill(heat_watch, SIGSTOP);
    ::kill(run.supervisor(), SIGSTOP);
    std::this_thread::sleep_for(3s);  // three times as long as a loop may be silent
    const auto& beat = run.layout().heartbeats[1].expected_by_ns;
    const std::int64_t old_promise = beat.load();
    ::kill(run.supervisor(), SIGCONT);
    std::this_thread::sleep_for(100ms);  // some ten looks of the supervisor's at old promises
    run.signal_sketch(SIGCONT);
    ::kill(heat_watch, SIGCONT);
    run.wait_for("a sign of life", [&] { return beat.load() != old_promise || run.gone(); });
    ASSERT_FALSE(run.gone()) << "it was killed for what nobody could keep";
    // A promise that it made since then counts as ever.
    run.signal_sketch(SIGSTOP);
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    expect_safe(run.machine());
    EXPECT_EQ(run.death(), SketchDeath::hung);
}

TEST(Supervisor, AFrozenSketchIsAHungOne) {
    SupervisedSketch run{"live"};
    run.wait_until_running();
    run.signal_sketch(SIGSTOP);
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    expect_safe(run.machine());
    EXPECT_EQ(run.death(), SketchDeath::hung);
}

TEST(Supervisor, ASketchThatLosesItsWardenIsEndedWithSafePins) {
    SupervisedSketch sketch{"never"};
    sketch.wait_until_running();
    SupervisedSketch::wait_for("the warden",
                               [&] { return sketch.layout().warden.load() != 0 || sketch.gone(); });
    const auto warden = static_cast<pid_t>(sketch.layout().warden.load());
    ASSERT_GT(warden, 0);
    ::kill(warden, SIGKILL);
    EXPECT_EQ(sketch.finish(), 128 + SIGKILL);
    EXPECT_EQ(sketch.death(), SketchDeath::hung);
    expect_safe(sketch.machine());
}

TEST(Supervisor, SigtermOfTheSketchItselfStopsItInOrder) {
    SupervisedSketch run{"live"};
    run.wait_until_running();
    run.signal_sketch(SIGTERM);
    EXPECT_EQ(run.finish(), 0);
    expect_safe(run.machine());
}

TEST(Supervisor, ASketchThatIsDeafToSigtermIsKilledAfterItsGrace) {
    SupervisedSketch run{"deaf"};
    run.wait_for_pin(11);
    ::kill(run.supervisor(), SIGTERM);
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    expect_safe(run.machine());
    EXPECT_EQ(run.death(), SketchDeath::hung);
}

TEST(Supervisor, SigtermIsHandedOnAndTheSketchStopsInOrder) {
    SupervisedSketch run{"live"};
    run.wait_until_running();
    ::kill(run.supervisor(), SIGTERM);
    EXPECT_EQ(run.finish(), 0);
    expect_safe(run.machine());
}

TEST(Supervisor, KillingTheSupervisorStopsTheSketchThroughItsSafeStates) {
    SupervisedSketch run{"live"};
    run.wait_until_running();
    const pid_t sketch = run.sketch();
    ASSERT_GT(sketch, 0);
    ::kill(run.supervisor(), SIGKILL);
    while (::kill(sketch, 0) == 0) std::this_thread::sleep_for(1ms);
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    expect_safe(run.machine());
}

/// A program that starts a supervisor, as the supervisor sees it, until it is killed.
class KilledStarter {
  public:
    KilledStarter() {
        int ends[2];
        EXPECT_EQ(::pipe(ends), 0);
        pid_ = ::fork();
        if (pid_ == 0) live_on(ends[1]);
        ::close(ends[1]);
        std::array<char, 64> said{};
        EXPECT_GT(::read(ends[0], said.data(), said.size() - 1), 0) << "the starter did not come up";
        ::close(ends[0]);
        // Its own descriptor, as another process finds it.
        path_ = "/proc/" + std::to_string(pid_) + std::string{said.data()}.substr(sizeof "/proc/self" - 1);
    }
    ~KilledStarter() { kill(); }
    KilledStarter(const KilledStarter&) = delete;
    KilledStarter& operator=(const KilledStarter&) = delete;
    [[nodiscard]] const std::string& path() const { return path_; }
    void kill() {
        if (pid_ <= 0) return;
        ::kill(pid_, SIGKILL);
        ::waitpid(pid_, nullptr, 0);
        pid_ = 0;
    }

  private:
    [[noreturn]] static void live_on(int report) {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        board::linux::StarterLife life;
        if (!life.begin()) ::_exit(1);
        const std::string path = life.path();
        static_cast<void>(!::write(report, path.c_str(), path.size()));
        for (;;) ::pause();
    }
    pid_t pid_ = 0;
    std::string path_;
};

TEST(Supervisor, ASketchEndsWithSafePinsWhenItsStarterIsKilledThoughNobodyAsksItToStop) {
    KilledStarter starter;
    const TemporaryLink link{0};
    // It is no child of the starter, and deaf: the kernel sends nothing, and it would hear nothing.
    SupervisedSketch run{"deaf", {"--link", link.path(), "--starter", starter.path()}};
    run.wait_for_pin(11);
    ASSERT_FALSE(run.gone()) << "it ended while its starter lived";
    starter.kill();
    ASSERT_NO_FATAL_FAILURE(run.wait_for("the end of an orphan", [&] { return run.gone(); }));
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    expect_safe(run.machine());
    EXPECT_EQ(run.death(), SketchDeath::died);
    EXPECT_NE(link.note().find("the program that started it died"), std::string::npos) << link.note();
}

TEST(Supervisor, WithRestartNoOrphanLivesAgain) {
    KilledStarter starter;
    SupervisedSketch run{"live", {"--restart", "--starter", starter.path()}};
    run.wait_until_running();
    starter.kill();
    ASSERT_NO_FATAL_FAILURE(run.wait_for("the end of an orphan", [&] { return run.gone(); }));
    run.finish();
    expect_safe(run.machine());
}

TEST(Supervisor, WithRestartTheSketchLivesAgain) {
    SupervisedSketch run{"live", {"--restart"}};
    run.wait_until_running();
    const pid_t first = run.sketch();
    run.signal_sketch(SIGKILL);
    while (run.sketch() == first || run.layout().outputs[10].level.load() == 0)
        std::this_thread::sleep_for(1ms);
    EXPECT_EQ(run.layout().sketch_dead.load(), 0u);
    ::kill(run.supervisor(), SIGTERM);
    run.finish();
    expect_safe(run.machine());
}

TEST(Supervisor, ACommandThatIsNotThereIsSaid) {
    TemporaryPins file;
    auto server = PinsServer::create(file.path());
    ASSERT_TRUE(server.ok());
    const std::string command =
        std::string{SUPERVISOR} + " --pins " + file.path() + " -- /nowhere/sketch 2>&1";
    FILE* output = ::popen(command.c_str(), "r");
    ASSERT_NE(output, nullptr);
    std::array<char, 256> text{};
    EXPECT_NE(std::fgets(text.data(), text.size(), output), nullptr);
    EXPECT_NE(std::string{text.data()}.find("/nowhere/sketch"), std::string::npos) << text.data();
    EXPECT_EQ(WEXITSTATUS(::pclose(output)), 127);
}

TEST(Supervisor, MarksTheLinkOfItsSketchAndNoOther) {
    const TemporaryLink mine{0};
    const TemporaryLink of_another{static_cast<std::uint32_t>(::getpid())};
    {
        SupervisedSketch run{"hang", {"--link", mine.path()}};
        run.finish();
        EXPECT_EQ(mine.dead(), 2u);
        EXPECT_NE(mine.note().find("loop 1 hung"), std::string::npos) << mine.note();
    }
    SupervisedSketch run{"exit", {"--link", of_another.path()}};
    run.finish();
    EXPECT_EQ(of_another.dead(), 0u);
    EXPECT_EQ(of_another.note(), "");
}

}  // namespace
}  // namespace qduino::board::linux::test::supervisor_test
