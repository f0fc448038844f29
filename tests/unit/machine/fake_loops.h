// Loops 2 and 3 without a board: 2 s of the print's own time are played in each release, and
// heaters follow their targets within a few samples.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "printer/link/frame.h"
#include "printer/machine/machine.h"
#include "twin/observer.h"

namespace qduino::printer::machine {

/// The ENABLE pins.
class NotedMotors final : public MotorSwitch {
  public:
    void switch_motor(Axis axis, bool on) override {
        log += kAxisLetter[static_cast<std::size_t>(axis)];
        log += on ? '+' : '-';
    }
    std::string log;
};

/// Loop 2: counts steps, passes markers, finds switches.
class FakeLoop2 {
  public:
    explicit FakeLoop2(MotionPipe& pipe) : pipe_(pipe) { switch_at_.fill(kNoSwitch); }

    /// The switch of `axis` reads pressed wherever its count is not above `steps`.
    void put_switch(Axis axis, std::int64_t steps) { switch_at_[static_cast<std::size_t>(axis)] = steps; }
    void play() {
        if (pipe_.stops().stop_asked() != seen_.stops_served) {
            seen_.stops_served = pipe_.stops().stop_asked();
            pipe_.ring().discard_all();
            homing_.reset();
        }
        if (pipe_.ring().empty()) stood_ += 100ms;
        const std::int64_t until_ns = seen_.timeline_ns + to_ns(2s);
        while (const step::StepEvent* next = pipe_.ring().front()) {
            if (next->time_ns > until_ns) {
                seen_.timeline_ns = until_ns;
                break;
            }
            play(*next);
            pipe_.ring().pop();
        }
        seen_.moving = !pipe_.ring().empty();
        seen_.events_taken = pipe_.ring().popped();
        pipe_.readers().write(seen_);
    }
    [[nodiscard]] const StepCounts& steps() const { return seen_.steps; }
    [[nodiscard]] bool moves() const { return seen_.moving; }
    /// A step that the motor made without a pulse of ours.
    void slip(Axis axis, std::int64_t steps) { seen_.steps[axis] += steps; }
    /// Sees each step, and each switch that changes.
    void observe(twin::MotionObserver* observer) { observer_ = observer; }

  private:
    static constexpr std::int64_t kNoSwitch = -1'000'000'000;

    void play(const step::StepEvent& event) {
        seen_.timeline_ns = event.time_ns;
        if (event.kind == step::EventKind::marker) seen_.last_marker = event.value;
        if (event.kind == step::EventKind::homing) {
            homing_.reset();
            if (event.value != 0) homing_ = event.axis;
            pressed_ = false;
        }
        if (event.kind != step::EventKind::step) return;
        if (homing_ == event.axis && !pressed_ && seen_.steps[event.axis] <= switch_at_[event.axis]) {
            pressed_ = true;
            ++seen_.endstop_hits[event.axis];
        }
        if (homing_ == event.axis && pressed_) return;
        seen_.steps[event.axis] += event.direction;
        ++seen_.pulses[event.axis];
        if (observer_ != nullptr) tell(event);
    }
    void tell(const step::StepEvent& event) {
        const Instant at = instant_from_ns(event.time_ns) + stood_;
        const std::int64_t now = seen_.steps[event.axis];
        const std::int64_t before = now - event.direction;
        const std::int64_t closes = switch_at_[event.axis];
        observer_->on_step({at, event.axis, event.direction, now});
        if ((now <= closes) != (before <= closes)) observer_->on_endstop(at, event.axis, now <= closes);
    }

    MotionPipe& pipe_;
    link::MotionCounts seen_;
    std::array<std::int64_t, kAxisCount> switch_at_{};
    std::optional<std::uint8_t> homing_;
    bool pressed_ = false;
    twin::MotionObserver* observer_ = nullptr;
    Nanoseconds stood_{};  // with nothing to play: no part of the time line
};

/// A whole machine, its service and its other loops.
class MachineBench {
  public:
    explicit MachineBench(const MachineConfig& config = {})
        : machine(std::make_unique<Machine>(by_pid(config), *link, motors)) {
        loop2.emplace(machine->motion());
        for (const Axis axis : gcode::kToolAxes) loop2->put_switch(axis, -100);
    }
    /// So many releases of loop 1, and all that the others do meanwhile.
    void run(int releases = 1) {
        for (int i = 0; i < releases; ++i) {
            now += 100ms;
            machine->plan(now);
            loop2->play();
            for (int sample = 0; sample < 12 && heat_samples; ++sample) sample_heat();
            drain_replies();
        }
    }
    template <typename Done>
    bool run_until(Done done, int releases = 2000) {
        while (!done() && releases-- > 0) run();
        return done();
    }
    bool reaches(State state) {
        return run_until([&] { return status().state == state; });
    }
    void command(link::Command command, std::string_view text = {}) {
        ASSERT_TRUE(link::try_push(link->commands, link::encode(link::CommandText{command, text})));
    }
    /// Does what it says at once: the command, and one release.
    std::string answer(link::Command asked, std::string_view text = {}) {
        replies.clear();
        command(asked, text);
        run();
        return replies;
    }
    void job(std::string_view text, std::uint64_t id = 1, bool whole = true) {
        const std::span bytes{reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
        ASSERT_TRUE(link::try_push(link->jobs, link::encode(link::JobBegin{id, text.size()})));
        for (std::size_t at = 0; at < text.size(); at += link::kMaxJobBytes) {
            const std::span part = bytes.subspan(at, std::min(link::kMaxJobBytes, text.size() - at));
            ASSERT_TRUE(link::try_push(link->jobs, link::encode(link::JobBytes{id, at, part})));
        }
        if (whole) {
            ASSERT_TRUE(link::try_push(link->jobs, link::encode(link::JobEnd{id})));
        }
    }
    [[nodiscard]] link::JobStatus status() { return link->job_status.read(); }
    [[nodiscard]] link::HeatStatus heat() { return link->heat_status.read(); }

    std::unique_ptr<link::LinkLayout> link = std::make_unique<link::LinkLayout>();
    NotedMotors motors;
    std::unique_ptr<Machine> machine;
    std::optional<FakeLoop2> loop2;
    Instant now = instant_from_ns(1'000'000'000);
    std::string replies;
    bool heat_samples = true;      ///< false: loop 3 hangs
    bool thermistor_open = false;  ///< of the hot end

  private:
    /// These heaters follow their targets whatever power they get: no model explains them.
    static MachineConfig by_pid(MachineConfig config) {
        config.hot_end.control = config.bed.control = HeaterControl::pid;
        return config;
    }
    static double follow(double celsius, double target) {
        return celsius + std::clamp(std::max(target, 20.0) - celsius, -0.5, 0.5);
    }
    void sample_heat() {
        heat_now_ += 8ms;
        heat::HeatReadings readings;
        if (!thermistor_open) readings.hot_end = Celsius{hot_end_};
        readings.bed = Celsius{bed_};
        static_cast<void>(machine->heat_sample(heat_now_, readings));
        hot_end_ = follow(hot_end_, heat().hot_end.target_celsius);
        bed_ = follow(bed_, heat().bed.target_celsius);
    }
    void drain_replies() {
        while (true) {
            const auto frame = reader_.read(link->replies);
            if (!frame.ok() || !frame->has_value()) return;
            const auto reply = link::decode_reply((*frame)->payload);
            if (reply.ok()) replies.append(reply->text).push_back('\n');
        }
    }

    link::FrameReader reader_;
    Instant heat_now_ = instant_from_ns(1'000'000'000);
    double hot_end_ = 20;
    double bed_ = 20;
};

}  // namespace qduino::printer::machine
