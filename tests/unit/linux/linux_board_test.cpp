// The Linux board on virtual pins: what it refuses, what it runs, what it reports. Without
// real-time priorities, so that no test can hold up the machine; timing is no matter here.
#include "board/linux/linux_board.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <functional>

#include "tests/unit/linux/fake_machine.h"
#include "tests/unit/linux/pins_fixture.h"

namespace qduino::board::linux::test::linux_board_test {
namespace {

LinuxConfig modest(const std::string& pins) {
    LinuxConfig config;
    config.pins_path = pins;
    config.real_time = false;
    config.lock_memory = false;
    config.handle_signals = false;
    return config;
}

std::unique_ptr<LinuxBoard> open(const LinuxConfig& config) {
    auto opened = LinuxBoard::open(config);
    EXPECT_TRUE(opened.ok()) << opened.error().message.view();
    return opened ? std::move(*opened) : nullptr;
}

VcpuSpec loop(VcpuId id, Nanoseconds budget, Nanoseconds period, std::function<void()>* body) {
    VcpuSpec spec;
    spec.id = id;
    spec.kind = id < kFirstIoVcpu ? VcpuKind::main : VcpuKind::io;
    spec.budget = budget;
    spec.period = period;
    spec.core = 0;
    if (body) spec.entry = [](void* function) { (*static_cast<std::function<void()>*>(function))(); };
    spec.context = body;
    return spec;
}

TEST(LinuxBoard, WithoutPinsSaysThatNothingIsConnected) {
    const auto board = open(modest(""));
    EXPECT_EQ(board->pin_mode(PinId{3}, PinMode::output).error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(board->i2c_transfer(I2cBus{0}, I2cAddress{0x48}, {}, {}).error().code, ErrorCode::unsupported);
    EXPECT_EQ(board->pin_read(PinId{200}), Level::low);
    board->pin_write(PinId{200}, Level::high);  // no effect, no fault
}

TEST(LinuxBoard, NamesADeviceThatIsNotThere) {
    LinuxConfig config = modest("");
    config.gpio.push_back({PinId{1}, 250, 4});
    const auto opened = LinuxBoard::open(config);
    ASSERT_FALSE(opened.ok());
    EXPECT_EQ(opened.error().code, ErrorCode::not_found);
    EXPECT_NE(opened.error().message.view().find("/dev/gpiochip250"), std::string_view::npos);

    LinuxConfig with_bus = modest("");
    with_bus.i2c.push_back({I2cBus{1}, 250});
    EXPECT_EQ(LinuxBoard::open(with_bus).error().code, ErrorCode::not_found);
}

TEST(LinuxBoard, RefusesMalformedSpecsAndRunsNothing) {
    const auto board = open(modest(""));
    bool ran = false;
    std::function<void()> body = [&ran] { ran = true; };
    const VcpuSpec good = loop(1, 1ms, 10ms, &body);
    VcpuSpec no_core = good;
    no_core.core = board->core_count();
    VcpuSpec no_body = good;
    no_body.entry = nullptr;
    VcpuSpec over_full = good;
    over_full.budget = 11ms;
    for (const VcpuSpec& bad : {no_core, no_body, over_full}) {
        const auto refused = board->start(std::array{bad});
        ASSERT_FALSE(refused.ok());
        EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
    }
    EXPECT_FALSE(board->start(std::array{good, good}).ok());  // the same id twice
    EXPECT_FALSE(ran);
}

TEST(LinuxBoard, RefusesABudgetThatCannotBeEnforcedOnASharedCore) {
    const auto board = open(modest(""));
    std::function<void()> body = [&board] { static_cast<void>(board->now()); };
    const VcpuSpec tiny = loop(1, 50us, 1ms, &body);
    const VcpuSpec other = loop(2, 1ms, 10ms, &body);
    const auto refused = board->start(std::array{tiny, other});
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::out_of_range);
    EXPECT_NE(refused.error().message.view().find("its own core"), std::string_view::npos);
}

TEST(LinuxBoard, RunsEachLoopOnceOnItsVcpuAndReturnsWhenAllHave) {
    const auto board = open(modest(""));
    std::atomic<int> runs{0};
    std::array<std::atomic<int>, 4> who{};
    std::array<std::function<void()>, 3> bodies;
    std::vector<VcpuSpec> specs;
    for (VcpuId id = 1; id <= 3; ++id) {
        bodies[id - 1u] = [&, id] {
            who[id] = board->current_vcpu();
            ++runs;
            while (!board->stop_requested()) board->sleep_until(board->now() + 1ms);
        };
        specs.push_back(loop(id, 1ms, 10ms, &bodies[id - 1u]));
    }
    EXPECT_EQ(board->current_vcpu(), kNoVcpu);
    ASSERT_TRUE(board->start(specs).ok());
    const Instant until = board->now() + 20ms;
    board->run(until);
    EXPECT_GE(board->now(), until);
    EXPECT_FALSE(board->stop_requested());
    board->request_stop();
    board->run(kForever);
    EXPECT_EQ(runs, 3);
    for (VcpuId id = 1; id <= 3; ++id) EXPECT_EQ(who[id], id);
}

TEST(LinuxBoard, NeitherWaitReturnsEarly) {
    const auto board = open(modest(""));
    for (const Nanoseconds wait :
         {Nanoseconds{-5}, Nanoseconds{0}, Nanoseconds{1}, Nanoseconds{700us}, Nanoseconds{3ms}}) {
        const Instant busy = board->now() + wait;
        board->busy_until(busy);
        EXPECT_GE(board->now(), busy);
        const Instant asleep = board->now() + wait;
        board->sleep_until(asleep);
        EXPECT_GE(board->now(), asleep);
    }
}

TEST(LinuxBoard, ForcesTheSafeStatesWhenItStops) {
    TemporaryPins file;
    RunningMachine running{file.path()};
    {
        const auto board = open(modest(file.path()));
        ASSERT_TRUE(board->pin_mode(PinId{3}, PinMode::output).ok());
        board->pin_write(PinId{3}, Level::high);
        ASSERT_TRUE(board->safe_state(PinId{3}, Level::low).ok());
        std::function<void()> body = [&board] {
            while (!board->stop_requested()) board->sleep_until(board->now() + 1ms);
            // A last write of the loop does not have the last word.
            board->pin_write(PinId{3}, Level::high);
        };
        ASSERT_TRUE(board->start(std::array{loop(1, 1ms, 10ms, &body)}).ok());
        board->request_stop();
        board->run(kForever);
    }
    running.stop();
    EXPECT_EQ(running.machine.seen.back().pin, 3);
    EXPECT_EQ(running.machine.seen.back().value, 0.0);
}

TEST(LinuxBoard, RunsTheHandlerOfEachEdgeOnItsIoVcpu) {
    TemporaryPins file;
    RunningMachine running{file.path()};
    const auto board = open(modest(file.path()));
    struct Heard {
        LinuxBoard* board;
        std::atomic<int> rising{0}, both{0}, vcpu{0};
    } heard{board.get()};
    constexpr PinId kPin{4};
    constexpr PinId kSecond{5};
    const EdgeHandler on_rising = [](void* context) {
        auto& to = *static_cast<Heard*>(context);
        to.vcpu = to.board->current_vcpu();
        ++to.rising;
    };
    ASSERT_TRUE(answered([&] { return board->pin_mode(kPin, PinMode::input); }).ok());
    ASSERT_TRUE(board->attach_edge(kPin, Edge::rising, on_rising, &heard, kFirstIoVcpu).ok());
    ASSERT_TRUE(board
                    ->attach_edge(
                        kSecond, Edge::both, [](void* context) { ++static_cast<Heard*>(context)->both; },
                        &heard, kFirstIoVcpu)
                    .ok());
    EXPECT_FALSE(board->attach_edge(kPin, Edge::rising, nullptr, nullptr, kFirstIoVcpu).ok());
    EXPECT_FALSE(board->attach_edge(kPin, Edge::rising, on_rising, nullptr, 1).ok());
    ASSERT_TRUE(board->attach_edge(kPin, Edge::rising, on_rising, &heard, kFirstIoVcpu).ok());
    ASSERT_TRUE(board->start(std::array{loop(kFirstIoVcpu, 1ms, 10ms, nullptr)}).ok());

    const auto drive = [&](PinId pin, bool high) {
        const EdgeCounts before{running.server().layout().inputs[pin.number].rising,
                                running.server().layout().inputs[pin.number].falling};
        running.machine.outside[pin.number] = high;
        auto& input = running.server().layout().inputs[pin.number];
        while ((high ? input.rising.load() : input.falling.load()) ==
               (high ? before.rising : before.falling)) {
            std::this_thread::sleep_for(200us);
        }
    };
    for (int i = 0; i < 5; ++i) {
        drive(kPin, true);
        drive(kPin, false);
        drive(kSecond, true);
        drive(kSecond, false);
    }
    while (heard.rising < 5 || heard.both < 10) std::this_thread::sleep_for(1ms);
    EXPECT_EQ(heard.vcpu, kFirstIoVcpu);
    board->detach_edge(kPin);
    drive(kPin, true);
    drive(kSecond, true);
    while (heard.both < 11) std::this_thread::sleep_for(1ms);
    EXPECT_EQ(heard.rising, 5);
    EXPECT_EQ(heard.both, 11);
    EXPECT_TRUE(board->guarantee().bottom_halves.empty()) << "while it runs, its times are its own";
    board->request_stop();
    board->run(kForever);
    const GuaranteeReport report = board->guarantee();
    ASSERT_EQ(report.bottom_halves.size(), 1u);
    const BottomHalfGuarantee& times = report.bottom_halves[0];
    EXPECT_EQ(times.id, kFirstIoVcpu);
    EXPECT_EQ(times.timed + times.untimed, 16u);
    EXPECT_GT(times.timed, 0u);
    EXPECT_LE(times.begin_median, times.begin_worst);
    EXPECT_LE(times.begin_worst, times.end_worst);
}

TEST(LinuxBoard, KeepsALoopThatNeverWaitsToItsBudget) {
    const auto board = open(modest(""));
    std::atomic<std::int64_t> consumed{0};
    std::function<void()> greedy = [&] {
        while (!board->stop_requested()) {
        }
        consumed = to_ns(thread_cpu_time());
    };
    std::function<void()> other = [&] {
        while (!board->stop_requested()) board->sleep_until(board->now() + 10ms);
    };
    const Instant before = board->now();
    ASSERT_TRUE(board->start(std::array{loop(1, 2ms, 20ms, &greedy), loop(2, 1ms, 10ms, &other)}).ok());
    board->run(before + 400ms);
    board->request_stop();
    board->run(kForever);
    const Nanoseconds took = board->now() - before;
    // 2 of 20 ms, and one budget more at either end of the window. Left to itself it would have
    // taken all there was.
    EXPECT_LE(consumed, to_ns(took) / 10 + 3 * 2'000'000);
    EXPECT_GT(consumed, 0);
    const GuaranteeReport report = board->guarantee();
    ASSERT_EQ(report.loops.size(), 2u);
    EXPECT_TRUE(report.loops[0].budget_enforced);
    EXPECT_FALSE(report.loops[0].priority_enforced);
}

TEST(LinuxBoard, ALoopThatSleepsUnannouncedDoesNotSaveUpBudget) {
    const auto board = open(modest(""));
    std::atomic<std::int64_t> consumed{0};
    Instant woke{};
    std::function<void()> sleeper = [&] {
        std::this_thread::sleep_for(200ms);  // not through the board: ten periods
        woke = board->now();
        const Nanoseconds from = thread_cpu_time();
        while (board->now() < woke + 60ms) {
        }
        consumed = to_ns(thread_cpu_time() - from);
    };
    std::function<void()> other = [] {};
    ASSERT_TRUE(board->start(std::array{loop(1, 2ms, 20ms, &sleeper), loop(2, 1ms, 10ms, &other)}).ok());
    board->request_stop();
    board->run(kForever);
    // Three periods of its own, one more at each end; had it saved up, another twenty milliseconds.
    const double periods = static_cast<double>((board->now() - woke).count()) / 20e6;
    EXPECT_LE(consumed, static_cast<std::int64_t>((periods + 2) * 2e6));
}

LinuxConfig on(const FakeMachine& machine) {
    LinuxConfig config = modest("");
    config.sysfs_root = machine.root();
    config.settings_state = machine.state();
    return config;
}

TEST(LinuxBoard, RoutesInterruptsAndPutsThemBackAtTheEnd) {
    FakeMachine machine;
    machine.put("/sys/kernel/irq/40/actions", "fe205000.i2c");
    machine.put("/proc/irq/40/smp_affinity_list", "0-1");
    {
        const auto board = open(on(machine));
        EXPECT_EQ(board->route_interrupts(DeviceClass::spi, 1, false).error().code, ErrorCode::not_found);
        EXPECT_EQ(board->route_interrupts(DeviceClass::i2c, 4096, false).error().code,
                  ErrorCode::invalid_argument);
        ASSERT_TRUE(board->route_interrupts(DeviceClass::i2c, 1, false).ok());
        EXPECT_EQ(machine.get("/proc/irq/40/smp_affinity_list"), "0");
        ASSERT_TRUE(board->route_interrupts(DeviceClass::i2c, 1, true).ok());
        EXPECT_EQ(machine.get("/proc/irq/40/smp_affinity_list"), "0-1");
        ASSERT_TRUE(board->route_interrupts(DeviceClass::i2c, 1, false).ok());
    }
    EXPECT_EQ(machine.get("/proc/irq/40/smp_affinity_list"), "0-1");
}

TEST(LinuxBoard, StopsTheTickOnlyWhereTheKernelWasBootedSo) {
    FakeMachine machine;
    machine.put("/sys/devices/system/cpu/nohz_full", "1");
    const auto board = open(on(machine));
    EXPECT_TRUE(board->core_timer(1, false).ok());
    EXPECT_EQ(board->core_timer(1, true).error().code, ErrorCode::unsupported);
    EXPECT_TRUE(board->core_timer(0, true).ok());
    const auto refused = board->core_timer(0, false);
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.error().message.view().find("nohz_full=0"), std::string_view::npos);
}

TEST(LinuxBoard, TheGuaranteeSaysWhatDoesNotHold) {
    FakeMachine machine;
    machine.put("/proc/sys/kernel/sched_rt_runtime_us", "950000");
    const auto board = open(on(machine));
    std::function<void()> body = [&] {
        while (!board->stop_requested()) board->sleep_until(board->now() + 1ms);
    };
    VcpuSpec owner = loop(1, 10ms, 10ms, &body);
    owner.owns_core = true;
    ASSERT_TRUE(board->serve_interrupts(DeviceClass::nic, kFirstIoVcpu).ok());
    VcpuSpec io = loop(kFirstIoVcpu, 1ms, 100ms, nullptr);
    io.core = board->core_count() - 1;
    ASSERT_TRUE(board->start(std::array{owner, io}).ok());
    const GuaranteeReport report = board->guarantee();
    board->request_stop();
    board->run(kForever);

    EXPECT_EQ(report.board.view(), "linux, best effort");
    EXPECT_FALSE(report.memory_locked);
    ASSERT_EQ(report.loops.size(), 2u);
    EXPECT_FALSE(report.loops[0].core_owned);
    EXPECT_NE(report.loops[0].shortfall.view().find("let the board isolate it"), std::string_view::npos);
    EXPECT_NE(report.loops[1].shortfall.view().find("threadirqs"), std::string_view::npos);
    ASSERT_GE(report.cores.size(), 1u);
    EXPECT_FALSE(report.cores[0].throttling_lifted);
    EXPECT_FALSE(report.cores[0].tick_stopped);
}

TEST(LinuxBoard, ARealPwmKeepsItsDutyWhenItsPeriodChanges) {
    FakeMachine machine;
    const std::string channel = "/sys/class/pwm/pwmchip0/pwm2/";
    const auto clear = [&] {  // the kernel's files do not keep what was in them
        for (const char* file : {"duty_cycle", "period", "enable"})
            std::ofstream{machine.path(channel + file)}.flush();
    };
    machine.put(channel + "period", "");
    clear();
    LinuxConfig config = on(machine);
    config.pwm.push_back({.pin = PinId{9}, .chip = 0, .channel = 2, .period = 1ms});
    const auto board = open(config);
    EXPECT_EQ(machine.get(channel + "period"), "1000000");
    EXPECT_EQ(machine.get(channel + "enable"), "0");  // nothing is driven yet
    clear();
    ASSERT_TRUE(board->pwm_write(PinId{9}, 0.25).ok());
    EXPECT_EQ(machine.get(channel + "duty_cycle"), "250000");
    EXPECT_EQ(machine.get(channel + "enable"), "1");
    clear();
    ASSERT_TRUE(board->pwm_period(PinId{9}, 20ms).ok());
    EXPECT_EQ(machine.get(channel + "period"), "20000000");
    EXPECT_EQ(machine.get(channel + "duty_cycle"), "5000000");
    clear();
    ASSERT_TRUE(board->pwm_write(PinId{9}, 0.075).ok());
    EXPECT_EQ(machine.get(channel + "duty_cycle"), "1500000");
    clear();
    ASSERT_TRUE(board->pwm_period(PinId{9}, Nanoseconds{0}).ok());
    EXPECT_EQ(machine.get(channel + "period"), "1000000");
    EXPECT_EQ(machine.get(channel + "duty_cycle"), "75000");
    EXPECT_EQ(board->pwm_period(PinId{9}, 2s).error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(board->pwm_period(PinId{10}, 20ms).error().code, ErrorCode::invalid_argument);

    // A chip that cannot: the old one holds.
    std::filesystem::remove(machine.path(channel + "period"));
    EXPECT_FALSE(board->pwm_period(PinId{9}, 20ms).ok());
    clear();
    ASSERT_TRUE(board->pwm_write(PinId{9}, 0.5).ok());
    EXPECT_EQ(machine.get(channel + "duty_cycle"), "500000");
}

TEST(LinuxBoard, ARealPwmChannelIsOffUntilItIsAnOutputAndThenHasTheLevelWrittenBefore) {
    FakeMachine machine;
    const std::string channel = "/sys/class/pwm/pwmchip0/pwm2/";
    machine.put(channel + "enable", "");
    for (const char* file : {"duty_cycle", "period"}) std::ofstream{machine.path(channel + file)}.flush();
    std::ofstream{machine.path(channel + "enable")} << '1';  // as a dead sketch has left it
    LinuxConfig config = on(machine);
    config.pwm.push_back({.pin = PinId{9}, .chip = 0, .channel = 2, .period = 1ms});
    const auto board = open(config);
    EXPECT_EQ(machine.get(channel + "enable"), "0");
    ASSERT_TRUE(board->safe_state(PinId{9}, Level::high).ok());
    board->pin_write(PinId{9}, Level::high);
    EXPECT_EQ(machine.get(channel + "duty_cycle"), "1000000");
    EXPECT_EQ(machine.get(channel + "enable"), "0");
    ASSERT_TRUE(board->pin_mode(PinId{9}, PinMode::output).ok());
    EXPECT_EQ(machine.get(channel + "enable"), "1");
    EXPECT_EQ(machine.get(channel + "duty_cycle"), "1000000");
}

/// What is guaranteed of core 0, which a loop owns, on a machine of files.
CoreGuarantee guarantee_of_an_owner(const FakeMachine& machine) {
    LinuxConfig config = on(machine);
    config.real_time = true;
    const auto board = open(config);
    std::function<void()> body = [&] {
        while (!board->stop_requested()) board->sleep_until(board->now() + 1ms);
    };
    VcpuSpec owner = loop(1, 10ms, 10ms, &body);
    owner.owns_core = true;
    EXPECT_TRUE(board->start(std::array{owner}).ok());
    const GuaranteeReport report = board->guarantee();
    board->request_stop();
    board->run(kForever);
    return report.cores.size() == 1 ? report.cores[0] : CoreGuarantee{};
}

TEST(LinuxBoard, ACoreThatAnotherSketchOwnsIsRefusedBeforeAnyLoopRuns) {
    FakeMachine machine;
    LinuxConfig config = on(machine);
    config.real_time = true;
    config.core_patience = 10ms;
    std::atomic<int> runs{0};
    std::function<void()> body = [&] { ++runs; };
    VcpuSpec owner = loop(1, 10ms, 10ms, &body);
    owner.owns_core = true;
    const auto first = open(config);
    ASSERT_TRUE(first->start(std::array{owner}).ok());
    {
        const auto second = open(config);
        const auto refused = second->start(std::array{owner});
        ASSERT_FALSE(refused.ok());
        EXPECT_EQ(refused.error().code, ErrorCode::unavailable);
        EXPECT_NE(refused.error().message.view().find("(pid " + std::to_string(::getpid()) + ") owns it"),
                  std::string_view::npos)
            << refused.error().message.view();
    }
    const auto modest_one = open(on(machine));  // no real-time priority: starves nobody
    EXPECT_TRUE(modest_one->start(std::array{owner}).ok());
    first->request_stop();
    first->run(kForever);
    modest_one->request_stop();
    modest_one->run(kForever);
    EXPECT_EQ(runs, 2);
}

TEST(LinuxBoard, ALoopSaysInThePinsFileWhereItRuns) {
    TemporaryPins file;
    const auto server = PinsServer::create(file.path());
    ASSERT_TRUE(server.ok());
    const auto board = open(modest(file.path()));
    std::function<void()> body = [] {};
    VcpuSpec spec = loop(3, 1ms, 10ms, &body);
    spec.core = board->core_count() - 1;
    ASSERT_TRUE(board->start(std::array{spec}).ok());
    const auto place = LoopPlace::from(server->layout().heartbeats[3].place.load());
    EXPECT_EQ(place.core, spec.core);
    EXPECT_EQ(place.priority, 0) << "it was not asked for";
    EXPECT_FALSE(LoopPlace::from(server->layout().heartbeats[2].place.load()).known());
    board->request_stop();
    board->run(kForever);
}

TEST(LinuxBoard, TheGuaranteeTellsACoreThatWasSetApartAtBoot) {
    FakeMachine machine;
    machine.put("/sys/devices/system/cpu/isolated", "0");
    machine.put("/sys/devices/system/cpu/nohz_full", "0");
    machine.put("/dev/cpu_dma_latency", "");
    const CoreGuarantee core = guarantee_of_an_owner(machine);
    EXPECT_EQ(core.note.view(), "set apart at boot (isolcpus)");
    EXPECT_TRUE(core.tick_stopped);
    EXPECT_EQ(machine.get("/dev/cpu_dma_latency"), std::string(4, '\0'))
        << "idle cores were asked to stay awake";
}

TEST(LinuxBoard, TheGuaranteeTellsThatIdleCoresMaySleep) {
    FakeMachine machine;
    machine.put("/sys/devices/system/cpu/nohz_full", "0");
    EXPECT_EQ(guarantee_of_an_owner(machine).note.view(),
              "idle cores may sleep deeply: late wake-ups (run as root)");
}

TEST(LinuxBoard, AnOwningLoopEntersItsIsolatedCore) {
    FakeMachine machine;
    machine.furnish();
    const std::string sets = "/sys/fs/cgroup/cpuset/qduino-core0/";
    for (const char* file :
         {"cpuset.cpus", "cpuset.mems", "cpuset.cpu_exclusive", "cpuset.sched_load_balance", "tasks"}) {
        machine.put(sets + file, "");
    }
    LinuxConfig config = on(machine);
    config.isolate = true;
    const auto board = open(config);
    if (board->core_count() < 2) GTEST_SKIP() << "needs two cores";
    std::atomic<pid_t> who{0};
    std::function<void()> body = [&] { who = ::gettid(); };
    VcpuSpec owner = loop(1, 10ms, 10ms, &body);
    owner.owns_core = true;
    ASSERT_TRUE(board->start(std::array{owner}).ok());
    EXPECT_EQ(machine.get("/proc/sys/kernel/sched_rt_runtime_us"), "-1");
    EXPECT_TRUE(board->guarantee().cores[0].throttling_lifted);
    board->request_stop();
    board->run(kForever);
    EXPECT_EQ(machine.get(sets + "tasks"), std::to_string(who));
}

TEST(LinuxBoard, AnIoVcpuThatWaitsForNothingEndsWhenTheBoardStops) {
    const auto board = open(modest(""));  // without pins, virtual or real
    std::function<void()> body = [&board] { board->request_stop(); };
    ASSERT_TRUE(board->start(std::array{loop(1, 1ms, 10ms, &body), loop(33, 1ms, 10ms, nullptr)}).ok());
    board->run(kForever);  // returns
    EXPECT_TRUE(board->stop_requested());
}

TEST(LinuxBoard, AHandlerMovesToTheIoVcpuThatItIsAttachedToLastAlsoWhileBothWait) {
    TemporaryPins file;
    RunningMachine running{file.path()};
    const auto board = open(modest(file.path()));
    struct Heard {
        LinuxBoard* board;
        std::atomic<int> first{0}, second{0};
    } heard{board.get()};
    const EdgeHandler count = [](void* context) {
        auto& to = *static_cast<Heard*>(context);
        ++(to.board->current_vcpu() == kFirstIoVcpu ? to.first : to.second);
    };
    constexpr PinId kPin{70};  // of the second half of the pins
    ASSERT_TRUE(board->attach_edge(kPin, Edge::both, count, &heard, kFirstIoVcpu).ok());
    ASSERT_TRUE(
        board->start(std::array{loop(kFirstIoVcpu, 1ms, 10ms, nullptr), loop(34, 1ms, 10ms, nullptr)}).ok());
    running.machine.outside[kPin.number] = true;
    while (heard.first < 1) std::this_thread::sleep_for(1ms);
    ASSERT_TRUE(board->attach_edge(kPin, Edge::both, count, &heard, 34).ok());
    running.machine.outside[kPin.number] = false;
    while (heard.second < 1) std::this_thread::sleep_for(1ms);
    EXPECT_EQ(heard.first, 1);
    EXPECT_EQ(heard.second, 1);
}

TEST(LinuxBoard, TheTemperatureIsThatOfTheFirstThermalZone) {
    FakeMachine machine;
    LinuxConfig config = modest("");
    config.sysfs_root = machine.root();
    const auto board = open(config);
    EXPECT_EQ(board->chip_temperature().error().code, ErrorCode::not_found);
    machine.put("/sys/class/thermal/thermal_zone0/temp", "48500");
    EXPECT_DOUBLE_EQ(*board->chip_temperature(), 48.5);
}

TEST(LinuxBoard, StopsOnSigtermAndGivesTheHandlersBack) {
    struct sigaction before {};
    ::sigaction(SIGTERM, nullptr, &before);
    {
        LinuxConfig config = modest("");
        config.handle_signals = true;
        const auto board = open(config);
        std::function<void()> body = [&] {
            while (!board->stop_requested()) board->sleep_until(board->now() + 1ms);
        };
        ASSERT_TRUE(board->start(std::array{loop(1, 1ms, 10ms, &body)}).ok());
        ::kill(::getpid(), SIGTERM);
        board->run(kForever);
        EXPECT_TRUE(board->stop_requested());
    }
    struct sigaction after {};
    ::sigaction(SIGTERM, nullptr, &after);
    EXPECT_EQ(after.sa_handler, before.sa_handler);
}

}  // namespace
}  // namespace qduino::board::linux::test::linux_board_test
