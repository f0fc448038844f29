// Every kind of hang ends a sketch through its safe states, with words that say which loop and
// what it did; and a sketch that waits for long on purpose is left alone.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <future>
#include <sstream>

#include "apps/supervisor/hang.h"
#include "tests/unit/linux/pins_fixture.h"

namespace qduino::board::linux::test::hang_test {
namespace {

using ::qduino::supervisor::find_hang;
using ::qduino::supervisor::Hang;
using ::qduino::supervisor::hang_text;
using ::qduino::supervisor::Pauses;

/// The supervisor's bound where a hang is to be noticed soon, and where none is to be seen though a
/// loaded computer lets ordinary processes wait. Both are shorter than the sketch's long waits.
constexpr Nanoseconds kSoon = 2s, kPatient = 4s;

/// One run of the hanging sketch under the supervisor.
struct HungRun {
    std::string output;
    int status = 0;
    SketchDeath death = SketchDeath::none;
    double heater = -1;  ///< pin 5, as the machine saw it last
    Instant forced;      ///< when it went low
};

/// The instant at which the sketch says that its hang begins; kEpoch: it says nothing.
Instant begin_of(const std::string& output) {
    const std::size_t at = output.find("HANG ");
    return at == std::string::npos ? kEpoch : instant_from_ns(std::atoll(output.c_str() + at + 5));
}

HungRun run_hanging(const std::string& how, Nanoseconds bound = kSoon) {
    const TemporaryPins pins, board;
    // As ordinary processes: no test hangs a core of the computer at real-time priority.
    std::ofstream{board.path()} << "[linux]\nsetup_bound = \"2 s\"\nreal_time = false\n";
    RunningMachine running{pins.path()};
    const std::string command =
        text<std::string>("HANG=", how, " " SUPERVISOR " --timeout-ms ", bound / 1ms, " --pins ", pins.path(),
                          " -- " HANGING_SKETCH " --board ", board.path(), " --pins ", pins.path(), " 2>&1");
    HungRun run;
    FILE* output = ::popen(command.c_str(), "r");
    if (!output) return run;
    if (how == "handler") {
        std::this_thread::sleep_for(1s);
        running.machine.outside[6] = true;
    }
    std::array<char, 4096> bytes{};
    for (std::size_t count = 0; (count = std::fread(bytes.data(), 1, bytes.size(), output)) > 0;)
        run.output.append(bytes.data(), count);
    const int status = ::pclose(output);
    run.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    running.stop();
    run.death = running.server().sketch_death();
    for (const Seen& event : running.machine.seen) {
        if (event.pin != 5) continue;
        if (run.heater == 1.0 && event.value == 0.0) run.forced = event.time;
        run.heater = event.value;
    }
    return run;
}

struct HangCase {
    const char* how;
    const char* name;  ///< of what hung
    const char* doing;
    Nanoseconds limit;  ///< not before
};

class EachHang : public ::testing::TestWithParam<HangCase> {};

TEST_P(EachHang, IsNoticedAndNamedAndThePinsAreForced) {
    const HangCase& hang = GetParam();
    const HungRun run = run_hanging(hang.how);
    SCOPED_TRACE(run.output);
    EXPECT_EQ(run.status, 128 + SIGKILL);
    EXPECT_EQ(run.death, SketchDeath::hung);
    EXPECT_NE(run.output.find(text<std::string>(hang.name, " hung")), std::string::npos);
    EXPECT_NE(run.output.find(hang.doing), std::string::npos);
    EXPECT_EQ(run.heater, 0.0);
    ASSERT_NE(begin_of(run.output), kEpoch);
    const Nanoseconds took = run.forced - begin_of(run.output);
    // Its last sign of progress was up to a period before it said that it hangs.
    EXPECT_GT(took, hang.limit - 100ms);
    std::printf("%s: the pin was forced %.3f s after the hang began (limit %.1f s)\n", hang.how,
                to_seconds(took), to_seconds(hang.limit));
}

INSTANTIATE_TEST_SUITE_P(OfASketch, EachHang,
                         ::testing::Values(HangCase{"setup", "setup()", "no progress for 2 s", 2s},
                                           HangCase{"poll", "loop 1", "it polls", 5s},
                                           HangCase{"delay", "loop 1", "it sleeps for another 9 h 59 min",
                                                    5s},
                                           HangCase{"promised", "loop 2", "it polls", 2s},
                                           HangCase{"spin", "loop 1", "after its heartbeat was due", 2s},
                                           HangCase{"handler", "the handlers of io 33", "it polls", 5s}),
                         [](const auto& instance) { return std::string{instance.param.how}; });

TEST(AHang, IsNotSeenInASketchThatWaitsForLongOnPurpose) {
    const std::array<const char*, 6> kinds{"slow-setup", "patient", "free",
                                           "unpromised", "classic", "overrun"};
    std::array<std::future<HungRun>, kinds.size()> runs;
    for (std::size_t i = 0; i < kinds.size(); ++i)
        runs[i] = std::async(std::launch::async, run_hanging, std::string{kinds[i]}, kPatient);
    for (std::size_t i = 0; i < kinds.size(); ++i) {
        const HungRun run = runs[i].get();
        SCOPED_TRACE(text<std::string>(kinds[i], ":\n", run.output));
        EXPECT_EQ(run.status, 0);
        EXPECT_NE(run.death, SketchDeath::hung);
        EXPECT_EQ(run.heater, 0.0) << "it ended in order, and so in its safe state";
    }
}

// ---- the finder, on promises made by hand -------------------------------------------------------

class HangFinder : public ::testing::Test {
  protected:
    Heartbeat& beat(VcpuId vcpu) { return layout_->heartbeats[vcpu]; }
    Hang find(Instant now) { return find_hang(*layout_, now, 1s); }

    static constexpr Instant kNow = kEpoch + 1000s;
    std::unique_ptr<PinsLayout> layout_ = std::make_unique<PinsLayout>();
};

TEST_F(HangFinder, TakesNobodyForHungWhoHasPromisedNothing) { EXPECT_FALSE(find(kNow).found()); }

TEST_F(HangFinder, FindsAPromiseBrokenByANanosecondAndNoneThatIsKept) {
    beat(2).expected_by_ns = to_ns(kNow);
    beat(3).progress_by_ns = to_ns(kNow);
    EXPECT_FALSE(find(kNow).found());
    beat(3).progress_by_ns = to_ns(kNow - 1ns);
    EXPECT_EQ(find(kNow).kind, Hang::Kind::stuck);
    EXPECT_EQ(find(kNow).vcpu, 3);
    EXPECT_EQ(find(kNow).overdue, 1ns);
    beat(2).expected_by_ns = to_ns(kNow - 1ns);
    EXPECT_EQ(find(kNow).kind, Hang::Kind::silent) << "a silent loop says more than a stuck one";
    EXPECT_EQ(find(kNow).vcpu, 2);
}

TEST_F(HangFinder, SaysWhatAStuckOneDoes) {
    beat(7).progress_by_ns = to_ns(kNow - 4ms);
    beat(7).progress_limit_ns = to_ns(Nanoseconds{5s});
    beat(7).expected_by_ns = to_ns(kNow + 1s + 1ms);
    EXPECT_EQ(hang_text(find(kNow), kNow),
              "loop 7 hung: no progress for 5 s (noticed 4 ms later); it polls: it runs or waits shortly, "
              "and does not end its release");
    beat(7).expected_by_ns = to_ns(kNow + 1s + 36000s);
    EXPECT_NE(hang_text(find(kNow), kNow).find("it sleeps for another 10 h 0 min, in a delay()"),
              std::string::npos);
    beat(7).expected_by_ns = to_ns(kForever);
    EXPECT_NE(hang_text(find(kNow), kNow).find("it waits without end"), std::string::npos);
}

TEST_F(HangFinder, JudgesAWardenByTheInstantThatItTells) {
    layout_->warden_by_ns = to_ns(kNow - 1ns);
    EXPECT_FALSE(find(kNow).found()) << "there is none";
    layout_->warden = 77;
    EXPECT_EQ(find(kNow).kind, Hang::Kind::unwatched) << "whoever lives under its number";
    EXPECT_EQ(hang_text(find(kNow + 3ms - 1ns), kNow),
              "its warden looked no more (noticed 3 ms after it was due to): nobody kept its loops to their "
              "budgets");
    layout_->warden_by_ns = to_ns(kNow);
    EXPECT_FALSE(find(kNow).found());
    layout_->warden_by_ns = kWardenLeft;
    EXPECT_FALSE(find(kNow).found());
    beat(2).expected_by_ns = to_ns(kNow - 1ns);
    layout_->warden_by_ns = 1;
    EXPECT_EQ(find(kNow).kind, Hang::Kind::silent) << "a loop says more";
}

TEST_F(HangFinder, LetsWhatWasPromisedBeforeAPauseHoldForLonger) {
    beat(2).expected_by_ns = to_ns(kNow - 5s);
    beat(3).progress_by_ns = to_ns(kNow + 1s);
    layout_->warden = 77;
    layout_->warden_by_ns = to_ns(kNow - 5s);
    Pauses pauses;
    pauses.turn_took(*layout_, Pauses::kLongestTurn);
    EXPECT_EQ(find_hang(*layout_, kNow, 1s, pauses).vcpu, 2) << "that was no pause";
    pauses.turn_took(*layout_, 2s);
    EXPECT_TRUE(find_hang(*layout_, kNow, 1s, pauses).found());
    pauses.turn_took(*layout_, 3s);
    EXPECT_FALSE(find_hang(*layout_, kNow, 1s, pauses).found()) << "both pauses count";
    EXPECT_EQ(find_hang(*layout_, kNow + 1ns, 1s, pauses).kind, Hang::Kind::silent);
    beat(2).expected_by_ns = to_ns(kNow - 1ns);
    EXPECT_EQ(find_hang(*layout_, kNow, 1s, pauses).overdue, 1ns) << "it was promised after the pause";
    beat(2).expected_by_ns = to_ns(kNow + 60s);
    EXPECT_EQ(find_hang(*layout_, kNow + 1ns, 1s, pauses).kind, Hang::Kind::unwatched);
    layout_->warden_by_ns = to_ns(kNow + 60s);
    EXPECT_FALSE(find_hang(*layout_, kNow + 6s, 1s, pauses).found());
    EXPECT_EQ(find_hang(*layout_, kNow + 6s + 1ns, 1s, pauses).kind, Hang::Kind::stuck);
    beat(3).progress_by_ns = to_ns(kForever);
    beat(2).expected_by_ns = to_ns(kEpoch);
    pauses.turn_took(*layout_, 3s);
    EXPECT_FALSE(find_hang(*layout_, kNow + 7s, 1s, pauses).found()) << "nothing is promised";
}

TEST_F(HangFinder, KnowsSetupByItsPromiseAlone) {
    beat(kNoVcpu).progress_by_ns = to_ns(kNow - 4ms);
    beat(kNoVcpu).progress_limit_ns = to_ns(Nanoseconds{10s});
    EXPECT_EQ(hang_text(find(kNow), kNow),
              "setup() hung: no progress for 10 s (noticed 4 ms later); it waits or polls for something that "
              "does not come");
}

}  // namespace
}  // namespace qduino::board::linux::test::hang_test
