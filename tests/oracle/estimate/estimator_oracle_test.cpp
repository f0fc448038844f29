// The estimate against a planner that has the whole job in memory: no queue, no laziness, and each
// move's time by small steps along its length.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "printer/estimate/estimator.h"
#include "printer/gcode/no_actions.h"
#include "printer/gcode/parser.h"
#include "printer/machine/limits.h"
#include "printer/motion/junction.h"
#include "printer/preflight/preflight.h"

namespace qduino::printer::estimate::estimator_oracle_test {
namespace {

using motion::MoveGeometry;

/// The moves and stops of a job as the interpreter hands them on.
class Listener final : public gcode::NoActions {
  public:
    explicit Listener(const MachineConfig& machine)
        : machine_(machine), accelerations_(machine::accelerations_of(machine)) {}

    Result<void> move(const gcode::Move& move) override {
        MoveGeometry geometry;
        double space2 = 0;
        PerAxis<double> delta{};
        for (std::size_t i = 0; i < kAxisCount; ++i) {
            delta[i] = (move.to[i] - move.from[i]).value();
            if (i < 3) space2 += delta[i] * delta[i];
        }
        geometry.extrude_only = space2 == 0;
        geometry.length_mm = geometry.extrude_only ? std::abs(delta[3]) : std::sqrt(space2);
        const double asked = accelerations_.of(move.kind);
        geometry.speed_mm_s = move.feedrate.value();
        geometry.acceleration_mm_s2 = asked;
        geometry.deviation_mm = motion::junction_deviation_mm(20, asked);
        for (std::size_t i = 0; i < kAxisCount; ++i) {
            geometry.direction[i] = delta[i] / geometry.length_mm;
            const double share = std::abs(geometry.direction[i]);
            if (share == 0) continue;
            const AxisConfig& axis = machine_.axes[i];
            const double rate = 1 / (to_seconds(step_interval(machine_)) * axis.steps_per_mm);
            geometry.speed_mm_s =
                std::min(geometry.speed_mm_s, std::min(axis.max_speed.value(), rate) / share);
            geometry.acceleration_mm_s2 =
                std::min(geometry.acceleration_mm_s2, axis.max_acceleration.value() / share);
        }
        moves.push_back(geometry);
        stops.push_back(stop_);
        stop_ = false;
        return {};
    }
    Result<void> set_limits(const gcode::LimitChange& change) override {
        if (change.print_acceleration) accelerations_.print = change.print_acceleration->value();
        if (change.travel_acceleration) accelerations_.travel = change.travel_acceleration->value();
        return {};
    }
    Result<void> dwell(Seconds duration) override {
        dwell_s += duration.value();
        stop_ = true;
        return {};
    }

    std::vector<MoveGeometry> moves;
    std::vector<bool> stops;  ///< at rest before it
    double dwell_s = 0;

  private:
    const MachineConfig& machine_;
    machine::Accelerations accelerations_;
    bool stop_ = true;
};

/// Time along a move, in pieces so short that the speed hardly changes in them.
double walk(const MoveGeometry& move, double entry2, double exit2) {
    constexpr int kPieces = 20'000;
    const double piece_mm = move.length_mm / kPieces;
    double time_s = 0;
    const auto speed_at = [&](double s_mm) {
        const double up2 = entry2 + 2 * move.acceleration_mm_s2 * s_mm;
        const double down2 = exit2 + 2 * move.acceleration_mm_s2 * (move.length_mm - s_mm);
        return std::sqrt(std::max(0.0, std::min({up2, down2, move.speed_mm_s * move.speed_mm_s})));
    };
    double before = speed_at(0);
    for (int i = 1; i <= kPieces; ++i) {
        const double after = speed_at(i * piece_mm);
        time_s += 2 * piece_mm / (before + after);
        before = after;
    }
    return time_s;
}

double oracle_s(const Listener& job, const MachineConfig& machine) {
    const std::size_t count = job.moves.size();
    PerAxis<MillimetresPerSecond> jumps{};
    for (std::size_t i = 0; i < kAxisCount; ++i) jumps[i] = machine.axes[i].instantaneous_speed;
    std::vector<double> speed2(count + 1, 0.0);
    for (std::size_t i = 1; i < count; ++i)
        if (!job.stops[i]) speed2[i] = motion::junction_speed_squared(job.moves[i - 1], job.moves[i], jumps);
    const auto gain2 = [&](std::size_t i) {
        return 2 * job.moves[i].acceleration_mm_s2 * job.moves[i].length_mm;
    };
    for (std::size_t i = count; i-- > 0;) speed2[i] = std::min(speed2[i], speed2[i + 1] + gain2(i));
    for (std::size_t i = 0; i < count; ++i) speed2[i + 1] = std::min(speed2[i + 1], speed2[i] + gain2(i));
    double time_s = job.dwell_s;
    for (std::size_t i = 0; i < count; ++i) time_s += walk(job.moves[i], speed2[i], speed2[i + 1]);
    return time_s;
}

/// A job of curves, corners, retractions, hops and dwells.
std::string random_job(std::mt19937& random) {
    const auto between = [&](double low, double high) {
        return std::uniform_real_distribution{low, high}(random);
    };
    std::string job = text<std::string>("M83\nM204 P", Fixed{between(400, 1800), 0}, " T",
                                        Fixed{between(400, 2500), 0}, "\n");
    double x = 75, y = 75, angle = 0;
    for (int i = 0; i < 400; ++i) {
        const int kind = static_cast<int>(between(0, 12));
        if (kind == 0)
            job += text<std::string>("G1 E", between(0, 2) < 1 ? "" : "-", Fixed{between(0.2, 2), 3},
                                     " F2400\n");
        if (kind == 1) job += text<std::string>("G1 Z", Fixed{between(0.2, 1), 2}, " F300\n");
        if (kind == 2 && i % 5 == 0) job += text<std::string>("G4 P", Fixed{between(0, 800), 0}, "\n");
        if (kind == 3) job += text<std::string>("G1 F", Fixed{between(300, 9000), 0}, "\n");
        angle += kind < 8 ? between(-0.3, 0.3) : between(-3, 3);
        const double length = kind < 6 ? between(0.05, 1) : between(1, 25);
        x = std::clamp(x + length * std::cos(angle), 5.0, 145.0);
        y = std::clamp(y + length * std::sin(angle), 5.0, 145.0);
        job += text<std::string>("G1 X", Fixed{x, 3}, " Y", Fixed{y, 3});
        if (kind % 3 != 0) job += text<std::string>(" E", Fixed{0.033 * length, 5});
        job += '\n';
    }
    return job;
}

TEST(EstimatorOracle, AgreesWithAPlannerThatSeesTheWholeJob) {
    const MachineConfig machine;
    for (unsigned seed = 1; seed <= 12; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random{seed};
        const std::string job = random_job(random);
        Listener listener{machine};
        gcode::Interpreter interpreter{machine, listener};
        gcode::Parser parser;
        parser.feed({job.data(), job.size()}, [&](const gcode::Line& line) {
            EXPECT_TRUE(line.command && interpreter.execute(*line.command).ok());
        });
        ASSERT_GT(listener.moves.size(), 300u);
        const auto estimator = std::make_unique<Estimator>(machine);
        preflight::Preflight preflight{machine};
        preflight.add_sink(*estimator);
        preflight.feed({job.data(), job.size()});
        static_cast<void>(preflight.finish());
        const double expected_s = oracle_s(listener, machine);
        const double estimated_s = estimator->estimate().total_s;
        EXPECT_GE(estimated_s, expected_s * (1 - 2e-4));
        EXPECT_LE(estimated_s, expected_s * (1 + 2e-4) + HeatForecast::kRelease_s) << "to the next release";
    }
}

}  // namespace
}  // namespace qduino::printer::estimate::estimator_oracle_test
