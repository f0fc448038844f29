// Bytes → lines → commands → actions. Whatever the bytes say: moves are finite, inside the bounds,
// joined to each other; temperatures, duties, times and limits are in range; a command that fails
// has changed nothing.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "fuzz_check.h"
#include "printer/gcode/interpreter.h"
#include "printer/gcode/parser.h"

namespace {

using namespace qduino;
using namespace qduino::printer;
using namespace qduino::printer::gcode;

/// Checks what it is asked for, and refuses every `refuse_every`-th action (0: none).
class Checker final : public Actions {
  public:
    explicit Checker(unsigned refuse_every) : refuse_every_(refuse_every) {}

    Result<void> move(const Move& move) override {
        FUZZ_EXPECT(!(move.from == move.to));
        FUZZ_EXPECT(move.from == at_);
        FUZZ_EXPECT(move.feedrate.value() > 0 && std::isfinite(move.feedrate.value()));
        for (const Axis axis : kAllAxes) FUZZ_EXPECT(std::isfinite(move.to[axis].value()));
        for (const Axis axis : kToolAxes) {
            const AxisConfig& limits = config_.axes[axis];
            const Millimetres to = move.to[axis];
            FUZZ_EXPECT(to >= limits.minimum && to <= limits.maximum);
        }
        const bool tool = move.kind != MoveKind::filament;
        FUZZ_EXPECT(tool || move.from[Axis::e] != move.to[Axis::e]);
        if (refuses()) return refusal();
        at_ = move.to;
        ++moves_;
        return {};
    }
    Result<void> dwell(Seconds duration) override {
        FUZZ_EXPECT(duration.value() >= 0 && duration <= kLongestDwell);
        return answer();
    }
    Result<void> home(AxisSet axes) override {
        FUZZ_EXPECT(!axes.empty() && !axes.contains(Axis::e));
        if (refuses()) return refusal();
        for (const Axis axis : kToolAxes) {
            if (axes.contains(axis)) at_[axis] = Millimetres{0};
        }
        return {};
    }
    Result<void> set_temperature(Heater heater, Celsius target) override {
        const HeaterConfig& config = heater == Heater::bed ? config_.bed : config_.hot_end;
        FUZZ_EXPECT(target.value() >= 0 && target <= highest_target(config));
        return answer();
    }
    Result<void> set_heater(Heater, const HeaterChange& change) override {
        for (const auto& each : {change.kp, change.ki, change.kd, change.loss_with_fan_w_k})
            FUZZ_EXPECT(!each || (std::isfinite(*each) && *each >= 0));
        for (const auto& each :
             {change.power_w, change.heat_capacity_j_k, change.sensor_lag_s, change.loss_w_k})
            FUZZ_EXPECT(!each || (std::isfinite(*each) && *each > 0));
        return answer();
    }
    Result<void> tune_heater(const TuningAsked& asked) override {
        FUZZ_EXPECT(asked.target.value() > 0 && asked.swings >= 3);
        return set_temperature(asked.heater, asked.target);
    }
    Result<void> settings(SettingsAsked) override { return answer(); }
    Result<void> wait_temperature(Heater heater, Celsius target, WaitFor) override {
        return set_temperature(heater, target);
    }
    Result<void> set_fan(std::uint8_t, double duty) override {
        FUZZ_EXPECT(duty >= 0 && duty <= 1);
        return answer();
    }
    Result<void> motors_off(AxisSet axes) override {
        FUZZ_EXPECT(!axes.empty());
        return answer();
    }
    Result<void> probe_bed() override {
        FUZZ_EXPECT(config_.probe.pin != kNoPin);
        return answer();
    }
    Result<void> change_bed(const BedChange& change) override {
        FUZZ_EXPECT(!change.fade_end || *change.fade_end >= Millimetres{0});
        const SkewConfig skew = change.skew.value_or(SkewConfig{});
        for (const double tangent : {skew.xy, skew.xz, skew.yz})
            FUZZ_EXPECT(tangent >= -kSkewMax && tangent <= kSkewMax);
        return answer();
    }
    Result<void> set_compensation(const CompensationChange& change) override {
        for (const auto& shaper : change.shapers) {
            const double hz = shaper.frequency_hz.value_or(0);
            FUZZ_EXPECT(hz == 0 || (hz >= kShaperFrequencyMin_hz && hz <= kShaperFrequencyMax_hz));
            const double damping = shaper.damping_ratio.value_or(0);
            FUZZ_EXPECT(damping >= 0 && damping <= kDampingRatioMax);
        }
        const Seconds advance = change.advance.value_or(Seconds{0});
        FUZZ_EXPECT(advance >= Seconds{0} && advance <= kAdvanceMax);
        FUZZ_EXPECT(!change.smooth_time ||
                    (*change.smooth_time >= kSmoothTimeMin && *change.smooth_time <= kSmoothTimeMax));
        return answer();
    }
    Result<void> set_limits(const LimitChange& change) override {
        for (std::size_t i = 0; i < kAxisCount; ++i) {
            const AxisConfig& config = config_.axes[i];
            if (change.axis_speed[i]) {
                FUZZ_EXPECT(change.axis_speed[i]->value() > 0 && *change.axis_speed[i] <= config.max_speed);
            }
            if (change.axis_acceleration[i]) {
                FUZZ_EXPECT(change.axis_acceleration[i]->value() > 0 &&
                            *change.axis_acceleration[i] <= config.max_acceleration);
            }
        }
        return answer();
    }
    void factors(double speed, double flow) override {
        FUZZ_EXPECT(speed > 0 && speed <= 10 && flow > 0 && flow <= 10);
    }
    void message(std::string_view) override {}
    void progress(const Progress& progress) override {
        FUZZ_EXPECT(!progress.percent || (*progress.percent >= 0 && *progress.percent <= 100));
    }
    void report(Report) override {}
    Result<void> pause(const PauseOrder&) override { return answer(); }
    Result<void> motors_time_out(Seconds) override { return answer(); }
    void emergency_stop() override {}
    void note(NoteKind, std::string_view, const Source&) override {}

    [[nodiscard]] std::uint64_t moves() const { return moves_; }

  private:
    bool refuses() { return refuse_every_ > 0 && ++asked_ % refuse_every_ == 0; }
    static Error refusal() { return make_error(ErrorCode::unavailable, "no"); }
    Result<void> answer() { return refuses() ? Result<void>{refusal()} : Result<void>{}; }

    MachineConfig config_;
    Position at_{};
    unsigned refuse_every_;
    unsigned asked_ = 0;
    std::uint64_t moves_ = 0;
};

bool same(const ModalState& a, const ModalState& b) {
    return a.unit_mm == b.unit_mm && a.relative == b.relative && a.relative_e == b.relative_e &&
           a.feedrate == b.feedrate && a.speed_factor == b.speed_factor && a.flow_factor == b.flow_factor &&
           a.machine == b.machine && a.offset == b.offset && a.programmed_e == b.programmed_e &&
           a.homed == b.homed && a.retracted == b.retracted && a.lifted == b.lifted;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 2) return 0;
    Checker checker{data[0] % 8U};
    const std::size_t moves_max = 1 + data[1] % 32;
    MachineConfig machine;
    machine.macros.push_back({"START", "G28\nG1 X{X=5} Y9\nG3 X{X=5} I4\nM116"});
    Interpreter interpreter{machine, checker};
    Parser parser;
    auto input = as_chars({data + 2, size - 2});
    const Line* line = nullptr;
    while ((line = parser.next(input)) != nullptr || (line = parser.finish()) != nullptr) {
        if (line->command == nullptr) continue;
        const ModalState before = interpreter.state();
        const std::uint64_t moves_before = checker.moves();
        auto done = interpreter.execute(*line->command, moves_max);
        if (!done && checker.moves() == moves_before) FUZZ_EXPECT(same(before, interpreter.state()));
        while (interpreter.pending()) {
            if (!interpreter.proceed(moves_max)) FUZZ_EXPECT(!interpreter.pending());
        }
        for (const Axis axis : kAllAxes)
            FUZZ_EXPECT(std::isfinite(interpreter.programmed_position()[axis].value()));
    }
    return 0;
}
