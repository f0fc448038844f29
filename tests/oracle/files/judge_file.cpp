// judge-steps FILE [--machine M.toml]: every step of a G-code file against dense numerical
// integration, the whole file, on the machine of a machine file.
//
//   file ─► Preflight ─► moves ─► MotionJudge: planner, solver ─► steps ─┐
//          (the printer's reader)              └► slow integration ──────┴─► within 50 ns?
//
// Wherever the machine comes to rest for something else than motion (homing, heat, a dwell, a
// pause, motors that go off) one motion ends and the next begins. Homing is a leap to the switches.
// Filters are those of the machine file: codes that change them are passed over.
//
// One line is written; it ends with 0 when every step is right, 1 when one is not (and which), 2
// when the file cannot be judged.
#include <array>
#include <cstdio>
#include <memory>
#include <span>
#include <string>

#include "config/machine_file.h"
#include "printer/machine/limits.h"
#include "printer/machine/vectors.h"
#include "printer/preflight/preflight.h"
#include "terminal/command_line.h"
#include "terminal/program.h"
#include "tests/oracle/motion/motion_judge.h"
#include "twin/byte_source.h"

namespace {

using namespace qduino;
using namespace qduino::printer;

constexpr int kExitWrong = 1;
constexpr int kExitUsage = 2;
constexpr apps::Fail fail{"judge-steps: ", kExitUsage};

class FileJudge final : public preflight::MoveSink {
  public:
    explicit FileJudge(const MachineConfig& machine)
        : machine_(machine),
          settings_(motion::motion_settings(machine)),
          accelerations_(machine::accelerations_of(machine)),
          at_mm_(machine::to_vector(home_positions(machine))) {}

    /// Whole from on_end() on.
    [[nodiscard]] const test::Judged& judged() const { return judged_; }
    [[nodiscard]] std::uint64_t moves() const { return moves_; }

    void on_move(const gcode::Move& move, const preflight::MoveContext&) override {
        if (!judged_.wrong.empty()) return;
        if (!judge_) judge_ = std::make_unique<test::MotionJudge>(machine_, at_mm_, grid());
        judge_->planner().set_settings(settings_);
        judge_->append({{move.to[0].value(), move.to[1].value(), move.to[2].value()},
                        (move.to[Axis::e] - move.from[Axis::e]).value(),
                        move.feedrate.value(),
                        accelerations_.of(move.kind)});
        at_mm_ = judge_->planner().position_mm();
        ++moves_;
    }
    void on_limits(const gcode::LimitChange& change) override {
        machine::apply(change, settings_, accelerations_);
    }
    void on_home(gcode::AxisSet axes) override {
        rest();
        for (const Axis axis : gcode::kToolAxes)
            if (axes.contains(axis)) at_mm_[axis] = machine_.axes[axis].home_position.value();
    }
    void on_dwell(Seconds) override { rest(); }
    void on_temperature(gcode::Heater, Celsius, std::optional<gcode::WaitFor> wait) override {
        if (wait) rest();
    }
    void on_pause() override { rest(); }
    void on_motors_off(gcode::AxisSet) override { rest(); }
    void on_end(std::uint64_t) override { rest(); }

  private:
    /// A pair of steps that is made is further apart than the gap, so a sample lies within.
    [[nodiscard]] test::MotionJudge::Grid grid() const {
        const test::Real between_s = 0.9L * static_cast<test::Real>(to_ns(machine_.reversal_gap)) * 1e-9L;
        return {between_s, between_s};
    }
    void rest() {
        if (judge_) judged_.add(judge_->finish());
        judge_.reset();
    }

    MachineConfig machine_;
    motion::MotionSettings settings_;
    machine::Accelerations accelerations_;
    motion::AxisVector at_mm_;
    std::unique_ptr<test::MotionJudge> judge_;  // of the motion in hand
    std::uint64_t moves_ = 0;
    test::Judged judged_;
};

int judge(const std::string& file, const MachineConfig& machine) {
    FileJudge judge(machine);
    const auto preflight = std::make_unique<preflight::Preflight>(machine);
    preflight->add_sink(judge);
    twin::FileSource source{file};
    std::array<char, 16 * 1024> bytes;
    while (const std::size_t count = source.read(bytes)) preflight->feed(std::span{bytes}.first(count));
    const preflight::Facts& facts = preflight->finish();
    if (!facts.accepted())
        return fail(text<std::string>("line ", facts.errors[0].line, ": ", facts.errors[0].message.view()));
    const test::Judged& found = judge.judged();
    if (found.steps == 0) return fail(file + ": nothing moves");
    std::printf(
        "%s: %llu moves, %llu steps, each judged; worst %.1f ns; %llu by their place; %llu pairs left "
        "out%s%s\n",
        found.wrong.empty() ? "right" : "WRONG", static_cast<unsigned long long>(judge.moves()),
        static_cast<unsigned long long>(found.steps), found.worst_ns,
        static_cast<unsigned long long>(found.ill_conditioned), static_cast<unsigned long long>(found.pairs),
        found.wrong.empty() ? "" : "; ", found.wrong.c_str());
    return found.wrong.empty() ? 0 : kExitWrong;
}

}  // namespace

int main(int argc, char** argv) {
    apps::CommandLine line{"Judges every step of a G-code file against dense numerical integration."};
    std::string file, machine_path;
    line.option("FILE", file, "The G-code file").required();
    line.option("--machine", machine_path, "Another printer than the reference machine (docs/machine.md)");
    if (const auto status = line.parse(argc, argv)) return *status;
    const Result<MachineConfig> machine = apps::read_machine_file(machine_path);
    if (!machine) return fail(machine.error());
    return judge(file, *machine);
}
