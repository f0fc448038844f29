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
    Result<void> set_temperature(Heater heater, Celsius target) override {
        return act("set " + name(heater) + " " + number(target.value()));
    }
    Result<void> wait_temperature(Heater heater, Celsius target, WaitFor direction) override {
        const std::string how = direction == WaitFor::heating ? " heating" : " either way";
        return act("wait " + name(heater) + " " + number(target.value()) + how);
    }
    Result<void> set_fan(std::uint8_t index, double duty) override {
        return act("fan " + std::to_string(index) + " " + number(duty));
    }
    Result<void> motors_off(AxisSet axes) override { return act("off" + letters(axes)); }
    Result<void> set_limits(const LimitChange& change) override { return act("limits" + describe(change)); }
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
                                         : "report firmware");
    }
    Result<void> pause(PauseReason reason, std::string_view text) override {
        return act((reason == PauseReason::requested ? "pause [" : "filament change [") + std::string(text) +
                   "]");
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
