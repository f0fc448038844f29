// Whatever end a sketch comes to, its pins end in their safe states, and whoever asks is told.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <map>
#include <new>
#include <random>

#include "printer/link/layout.h"
#include "tests/unit/linux/pins_fixture.h"

namespace qduino::board::linux::test {
namespace {

/// The state of the doomed sketch's pins as the machine saw them last; −1: never seen.
struct LastSeen {
    std::map<std::uint16_t, double> level;
    std::map<std::uint16_t, double> duty;
};

LastSeen last_seen(const RecordingMachine& machine) {
    LastSeen last;
    for (const Seen& event : machine.seen) (event.pwm ? last.duty : last.level)[event.pin] = event.value;
    return last;
}

void expect_safe(const RecordingMachine& machine) {
    const LastSeen last = last_seen(machine);
    EXPECT_EQ(last.level.at(3), 0.0);
    EXPECT_EQ(last.duty.at(4), 0.0);
    EXPECT_EQ(last.level.at(4), 0.0);
    EXPECT_EQ(last.level.at(5), 1.0);
    EXPECT_EQ(last.level.at(6), 1.0);
}

/// When the machine saw the first pin forced: the heater's end.
Instant first_forced(const RecordingMachine& machine) {
    Instant at = kEpoch;
    for (const Seen& event : machine.seen) {
        if (event.pin == 3 && !event.pwm && event.value == 0.0) at = event.time;
    }
    return at;
}

/// For people, and for the machine that the figure is of: printed, never asserted.
void say_how_late(const char* what, Nanoseconds late) {
    std::printf("the pins were forced %.2f ms after %s (the design's bound: 100 ms)\n",
                to_seconds(late) * 1e3, what);
}

/// qduino-supervisor over the doomed sketch, on the pins of a running machine.
class SupervisedSketch {
  public:
    explicit SupervisedSketch(const std::string& end, std::vector<std::string> more = {})
        : running_(file_.path()) {
        std::vector<std::string> words{SUPERVISOR, "--pins", file_.path(), "--timeout-ms", "100"};
        words.insert(words.end(), more.begin(), more.end());
        words.insert(words.end(), {"--", DOOMED_SKETCH, file_.path(), end});
        std::vector<char*> arguments;
        for (auto& word : words) arguments.push_back(word.data());
        arguments.push_back(nullptr);
        supervisor_ = ::fork();
        if (supervisor_ == 0) {
            ::execv(SUPERVISOR, arguments.data());
            ::_exit(126);
        }
    }
    ~SupervisedSketch() {
        if (supervisor_ > 0 && !ended_) {
            ::kill(supervisor_, SIGTERM);
            ::waitpid(supervisor_, nullptr, 0);
        }
    }
    SupervisedSketch(const SupervisedSketch&) = delete;
    SupervisedSketch& operator=(const SupervisedSketch&) = delete;

    /// Waits until the sketch has set all its pins and runs its loops (or has come to its end already).
    void wait_until_running() { wait_for_pin(10); }
    void wait_for_pin(std::size_t pin) {
        while (layout().outputs[pin].level.load() == 0 && !gone()) std::this_thread::sleep_for(1ms);
    }
    /// Never to process 0, which would be this test and its relatives.
    void signal_sketch(int number) {
        const pid_t pid = sketch();
        ASSERT_GT(pid, 0) << "the sketch did not come up";
        ::kill(pid, number);
    }
    [[nodiscard]] pid_t sketch() { return static_cast<pid_t>(layout().sketch_pid.load()); }
    [[nodiscard]] pid_t supervisor() const { return supervisor_; }
    [[nodiscard]] PinsLayout& layout() { return running_.server().layout(); }

    /// Waits for the supervisor's end; then the machine's record is final. The status as a shell would see it.
    int finish() {
        int status = 0;
        ::waitpid(supervisor_, &status, 0);
        ended_ = true;
        running_.stop();
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
    [[nodiscard]] const RecordingMachine& machine() const { return running_.machine; }
    [[nodiscard]] SketchDeath death() { return running_.server().sketch_death(); }

  private:
    [[nodiscard]] bool gone() const {
        siginfo_t info{};
        return ::waitid(P_PID, static_cast<id_t>(supervisor_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
               info.si_pid != 0;
    }

    TemporaryPins file_;
    RunningMachine running_;
    pid_t supervisor_ = -1;
    bool ended_ = false;
};

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

TEST(Supervisor, AFrozenSketchIsAHungOne) {
    SupervisedSketch run{"live"};
    run.wait_until_running();
    run.signal_sketch(SIGSTOP);
    EXPECT_EQ(run.finish(), 128 + SIGKILL);
    expect_safe(run.machine());
    EXPECT_EQ(run.death(), SketchDeath::hung);
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

/// A link file as a sketch makes it, of the process `owner`.
class TemporaryLink {
  public:
    explicit TemporaryLink(std::uint32_t owner) {
        using printer::link::LinkLayout;
        const int fd = ::open(file_.path().c_str(), O_RDWR | O_CREAT, 0600);
        EXPECT_EQ(::ftruncate(fd, sizeof(LinkLayout)), 0);
        void* memory = ::mmap(nullptr, sizeof(LinkLayout), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
        ::close(fd);
        layout_ = new (memory) LinkLayout;
        layout_->version = printer::link::kVersion;
        layout_->size = sizeof(LinkLayout);
        layout_->sketch_pid = owner;
        layout_->magic.store(printer::link::kMagic);
    }
    ~TemporaryLink() { ::munmap(layout_, sizeof *layout_); }
    TemporaryLink(const TemporaryLink&) = delete;
    TemporaryLink& operator=(const TemporaryLink&) = delete;
    [[nodiscard]] const std::string& path() const { return file_.path(); }
    [[nodiscard]] std::uint32_t dead() const { return layout_->sketch_dead.load(); }

  private:
    TemporaryPins file_;
    printer::link::LinkLayout* layout_ = nullptr;
};

TEST(Supervisor, MarksTheLinkOfItsSketchAndNoOther) {
    const TemporaryLink mine{0};
    const TemporaryLink of_another{static_cast<std::uint32_t>(::getpid())};
    {
        SupervisedSketch run{"hang", {"--link", mine.path()}};
        run.finish();
        EXPECT_EQ(mine.dead(), 2u);
    }
    SupervisedSketch run{"exit", {"--link", of_another.path()}};
    run.finish();
    EXPECT_EQ(of_another.dead(), 0u);
}

}  // namespace
}  // namespace qduino::board::linux::test
