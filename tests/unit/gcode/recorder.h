// A machine that writes down what it is asked for, in words: the tests compare the words.
#pragma once

#include <sstream>
#include <string>
#include <vector>

#include "printer/gcode/actions.h"
#include "printer/gcode/interpreter.h"
#include "printer/gcode/parser.h"

namespace qduino::printer::gcode {

class Recorder final : public Actions {
  public:
    std::vector<std::string> log;
    std::vector<Move> moves;
    /// Refuses the n-th action from now on (0: the next), once; −1: never.
    int refuse_after = -1;

    Result<void> move(const Move& move) override {
        if (auto refused = refusal(); !refused) return refused;
        moves.push_back(move);
        std::ostringstream out;
        out << (move.kind == MoveKind::travel  ? "travel"
                : move.kind == MoveKind::print ? "print"
                                               : "filament");
        for (std::size_t i = 0; i < 4; ++i) {
            if (move.from[i] != move.to[i]) out << ' ' << kAxisLetter[i] << move.to[i].value();
        }
        out << " at " << move.feedrate.value();
        say(out.str());
        return {};
    }
    Result<void> dwell(Seconds duration) override { return act("dwell " + number(duration.value())); }
    Result<void> home(AxisSet axes) override { return act("home" + letters(axes)); }
    Result<void> probe_bed() override { return act("probe bed"); }
    Result<void> change_bed(const BedChange& change) override {
        std::string words = "bed";
        if (change.follow) words += *change.follow ? " follow" : " plane";
        if (change.forget) words += " forget";
        if (change.fade_end) words += " fade " + number(change.fade_end->value());
        if (change.profile == BedProfile::save) words += " save " + std::string(change.name);
        if (change.profile == BedProfile::load) words += " load " + std::string(change.name);
        if (change.profile == BedProfile::remove) words += " remove " + std::string(change.name);
        if (change.skew) {
            for (const double factor : {change.skew->xy, change.skew->xz, change.skew->yz})
                words += " " + number(factor);
        }
        return act(words);
    }
    Result<void> set_temperature(Heater heater, Celsius target) override {
        return act("set " + name(heater) + " " + number(target.value()));
    }
    Result<void> wait_temperature(Heater heater, Celsius target, WaitFor direction) override {
        std::string how = direction == WaitFor::heating ? " heating" : " either way";
        if (direction.kind == WaitFor::between)
            how = " from " + number(direction.lowest.value()) + " to " + number(direction.highest.value());
        return act("wait " + name(heater) + " " + number(target.value()) + how);
    }
    Result<void> set_heater(Heater heater, const HeaterChange& change) override {
        std::string words = "settings of " + name(heater);
        const std::pair<const char*, std::optional<double>> given[]{
            {"kp", change.kp},
            {"ki", change.ki},
            {"kd", change.kd},
            {"power", change.power_w},
            {"capacity", change.heat_capacity_j_k},
            {"lag", change.sensor_lag_s},
            {"loss", change.loss_w_k},
            {"loss with fan", change.loss_with_fan_w_k},
            {"filament", change.filament_j_mm3_k}};
        for (const auto& [word, value] : given)
            if (value) words += std::string(", ") + word + " " + number(*value);
        return act(words);
    }
    Result<void> tune_heater(const TuningAsked& asked) override {
        return act("tune " + name(asked.heater) + (asked.kind == HeaterControl::pid ? " gains" : " model") +
                   " at " + number(asked.target.value()) + ", " + std::to_string(asked.swings) + " swings" +
                   (asked.use ? ", use" : ""));
    }
    Result<void> settings(SettingsAsked asked) override {
        return act(asked == SettingsAsked::keep      ? "keep settings"
                   : asked == SettingsAsked::restore ? "restore settings"
                                                     : "factory settings");
    }
    Result<void> set_fan(std::uint8_t index, double duty) override {
        return act("fan " + std::to_string(index) + " " + number(duty));
    }
    Result<void> motors_off(AxisSet axes) override { return act("off" + letters(axes)); }
    Result<void> set_limits(const LimitChange& change) override { return act("limits" + describe(change)); }
    Result<void> set_compensation(const CompensationChange& change) override {
        std::ostringstream out;
        out << "compensate";
        for (std::size_t axis = 0; axis < change.shapers.size(); ++axis) {
            const auto& shaper = change.shapers[axis];
            if (shaper.type) out << ' ' << kAxisLetter[axis] << " type " << static_cast<int>(*shaper.type);
            if (shaper.frequency_hz) out << ' ' << kAxisLetter[axis] << ' ' << *shaper.frequency_hz << " Hz";
            if (shaper.damping_ratio) out << ' ' << kAxisLetter[axis] << " damping " << *shaper.damping_ratio;
        }
        if (change.advance) out << " advance " << change.advance->value();
        if (change.smooth_time) out << " smooth " << change.smooth_time->value();
        return act(out.str());
    }
    void factors(double speed, double flow) override { say("factors " + number(speed) + " " + number(flow)); }
    void message(std::string_view text) override { say("message [" + std::string(text) + "]"); }
    void progress(const Progress& progress) override {
        std::string text = "progress";
        if (progress.percent) text += " " + number(*progress.percent) + "%";
        if (progress.remaining) text += " " + number(progress.remaining->value()) + "s";
        say(text);
    }
    void report(Report what) override {
        say(what == Report::temperatures ? "report temperatures"
            : what == Report::position   ? "report position"
            : what == Report::firmware   ? "report firmware"
            : what == Report::progress   ? "report progress"
                                         : "report settings " + std::to_string(static_cast<int>(what)));
    }
    Result<void> pause(const PauseOrder& order) override {
        std::string line = order.reason == PauseReason::requested ? "pause [" : "filament change [";
        line += std::string(order.text) + "]";
        const auto add = [&](const char* name, const std::optional<Millimetres>& mm) {
            if (mm) line += " " + std::string(name) + text<std::string>(Shortest{mm->value()});
        };
        add("X", order.x);
        add("Y", order.y);
        add("lift ", order.lift);
        add("retract ", order.retract);
        add("unload ", order.unload);
        add("purge ", order.purge);
        return act(line);
    }
    Result<void> motors_time_out(Seconds after) override {
        return act(text<std::string>("off after ", Shortest{after.value()}));
    }
    void emergency_stop() override { say("emergency stop"); }
    void note(NoteKind kind, std::string_view text, const Source& source) override {
        const char* const names[] = {"echo", "unknown", "not done", "warning"};
        say(std::string(names[static_cast<int>(kind)]) + " line " + std::to_string(source.line) + ": " +
            std::string(text));
    }

    static std::string number(double value) {
        std::ostringstream out;
        out << value;
        return out.str();
    }

  private:
    Result<void> refusal() {
        if (refuse_after < 0 || refuse_after-- > 0) return {};
        return make_error(ErrorCode::unavailable, "the machine refuses");
    }
    void say(std::string text) { log.push_back(std::move(text)); }
    Result<void> act(std::string text) {
        if (auto refused = refusal(); !refused) return refused;
        say(std::move(text));
        return {};
    }
    static std::string name(Heater heater) { return heater == Heater::bed ? "bed" : "hot end"; }
    static std::string letters(AxisSet axes) {
        std::string text = " ";
        for (const Axis axis : kAllAxes) {
            if (axes.contains(axis)) text += kAxisLetter[axis];
        }
        return text;
    }
    static std::string describe(const LimitChange& change) {
        std::string text;
        for (std::size_t i = 0; i < 4; ++i) {
            const std::string axis{kAxisLetter[i]};
            if (change.axis_acceleration[i])
                text += " a" + axis + number(change.axis_acceleration[i]->value());
            if (change.axis_speed[i]) text += " v" + axis + number(change.axis_speed[i]->value());
            if (change.axis_instantaneous_speed[i]) {
                text += " j" + axis + number(change.axis_instantaneous_speed[i]->value());
            }
        }
        if (change.print_acceleration) text += " print" + number(change.print_acceleration->value());
        if (change.filament_acceleration) text += " filament" + number(change.filament_acceleration->value());
        if (change.travel_acceleration) text += " travel" + number(change.travel_acceleration->value());
        if (change.junction_deviation) text += " deviation" + number(change.junction_deviation->value());
        if (change.minimum_extrude) text += " extrude" + number(change.minimum_extrude->value());
        return text;
    }
};

/// Parser, interpreter and recorder, fed with text.
class Bench {
  public:
    explicit Bench(const MachineConfig& config = MachineConfig{}) : interpreter(config, recorder) {}

    /// Runs a text of its own, whose first line is line 1; returns what was recorded meanwhile,
    /// errors as "error: …".
    std::vector<std::string> run(std::string_view text) {
        recorder.log.clear();
        parser.reset();
        parser.feed(std::span<const char>{text.data(), text.size()}, *this);
        parser.finish(*this);
        return recorder.log;
    }
    void operator()(const Line& line) {
        if (const auto heeded = interpreter.heed(line); !heeded) {
            recorder.log.push_back("error: " + std::string(heeded.error().message.view()));
            return;
        }
        if (line.error) recorder.log.push_back("error: " + std::string(line.error->message.view()));
        if (line.command == nullptr) return;
        if (auto done = interpreter.execute(*line.command); !done) {
            recorder.log.push_back("error: " + std::string(done.error().message.view()));
        }
    }

    Recorder recorder;
    Interpreter interpreter;
    Parser parser;
};

}  // namespace qduino::printer::gcode
