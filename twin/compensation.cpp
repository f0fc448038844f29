#include "twin/compensation.h"

#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

namespace qduino::twin {
namespace {

constexpr double kSwingLeft = 0.05;  // by EI shapers, at their frequency

/// Impulses of an undamped swing: amplitude, and place in periods.
struct Impulse {
    double amplitude = 0;
    double period = 0;
};

/// Two humps: of the four amplitudes a, ½ − a, ½ − a, a the outer one.
double two_hump_outer() {
    const double v2 = kSwingLeft * kSwingLeft;
    const double x = std::pow(v2 * (1 + std::sqrt(1 - v2)), 1.0 / 3);
    return (3 * x * x + 2 * x + 3 * v2) / (16 * x);
}

std::vector<Impulse> undamped(Shaper shaper) {
    const double edge = 1 - std::numbers::sqrt2 / 2;
    const double outer = two_hump_outer();
    switch (shaper) {
        case Shaper::none:
            break;
        case Shaper::zv:
            return {{0.5, 0}, {0.5, 0.5}};
        case Shaper::zvd:
            return {{0.25, 0}, {0.5, 0.5}, {0.25, 1}};
        case Shaper::mzv:
            return {{edge, 0}, {1 - 2 * edge, 0.375}, {edge, 0.75}};
        case Shaper::ei:
            return {{(1 + kSwingLeft) / 4, 0}, {(1 - kSwingLeft) / 2, 0.5}, {(1 + kSwingLeft) / 4, 1}};
        case Shaper::two_hump_ei:
            return {{outer, 0}, {0.5 - outer, 0.5}, {0.5 - outer, 1}, {outer, 1.5}};
    }
    return {{1, 0}};
}

Shaper shaper_named(std::string_view name, Shaper otherwise) {
    std::string lower;
    for (const char c : name) lower += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    if (lower == "zv") return Shaper::zv;
    if (lower == "zvd") return Shaper::zvd;
    if (lower == "mzv") return Shaper::mzv;
    if (lower == "ei") return Shaper::ei;
    if (lower == "2hump_ei" || lower == "ei2") return Shaper::two_hump_ei;
    return lower == "none" ? Shaper::none : otherwise;
}

}  // namespace

ShaperMoments moments_of(const ShaperSpec& shaper) {
    if (shaper.type == Shaper::none || shaper.frequency_hz <= 0) return {};
    const double z = shaper.damping_ratio;
    const double root = std::sqrt(1 - z * z);
    std::vector<Impulse> impulses = undamped(shaper.type);
    double sum = 0;
    double mean = 0;
    for (Impulse& impulse : impulses) {
        // A later impulse meets a swing that has died down as far.
        impulse.amplitude *= std::exp(-2 * std::numbers::pi * z / root * impulse.period);
        sum += impulse.amplitude;
        mean += impulse.amplitude * impulse.period;
    }
    mean /= sum;
    const double period_s = 1 / (shaper.frequency_hz * root);
    ShaperMoments moments{.reach_s = impulses.back().period * period_s};
    for (const Impulse& impulse : impulses) {
        const double off_s = (impulse.period - mean) * period_s;
        moments.one_sided_s += impulse.amplitude / sum * std::max(off_s, 0.0);
        moments.second_s2 += impulse.amplitude / sum * off_s * off_s;
    }
    return moments;
}

Reach Compensation::reach(const Machine& machine) const {
    Reach reach;
    double sideways_mm2 = 0;
    double overlap_s = smooth_s();
    for (std::size_t axis = 0; axis < shapers_.size(); ++axis) {
        const ShaperMoments moments = moments_of(shapers_[axis]);
        const AxisSpec& spec = machine.axes[axis];
        // Two corners may lie within the reach of the shaper.
        const double off_mm = 0.5 * spec.top_acceleration_mm_s2 * moments.second_s2 +
                              2 * spec.corner_mm_s * moments.one_sided_s;
        sideways_mm2 += off_mm * off_mm;
        overlap_s = std::max(overlap_s, moments.reach_s + smooth_s());
    }
    reach.mm[0] = reach.mm[1] = reach.mm[2] = std::sqrt(sideways_mm2);
    reach.mm[kExtruder] = machine.axes[kExtruder].top_speed_mm_s * (overlap_s + advance_s_);
    return reach;
}

void Compensation::run(const CommandLine& command) {
    if (command.letter == 'M' && command.number == 593) return shape(command);
    if (command.word == "SET_INPUT_SHAPER") return shape_by_words(command);
    if (command.letter == 'M' && command.number == 900 && command.has('K'))
        return advance(command.value('K'));
    if (command.letter == 'M' && command.number == 572 && command.has('S') && command.value('D') == 0)
        return advance(command.value('S'));
    if (command.word != "SET_PRESSURE_ADVANCE") return;
    if (const auto seconds = command.word_number("ADVANCE")) advance(*seconds);
    if (const auto seconds = command.word_number("SMOOTH_TIME")) {
        ++changes_;
        smooth_s_ = std::max(*seconds, 0.001);
    }
}

/// M593 F D (or S) X Y, T a number or P"a name".
void Compensation::shape(const CommandLine& command) {
    ++changes_;
    const bool both = !command.has('X') && !command.has('Y');
    for (std::size_t axis = 0; axis < shapers_.size(); ++axis) {
        if (!both && !command.has(kAxisLetter[axis])) continue;
        ShaperSpec& shaper = shapers_[axis];
        if (command.has('F')) shaper.frequency_hz = command.value('F');
        shaper.damping_ratio = command.value('D', command.value('S', shaper.damping_ratio));
        const bool first = shaper.type == Shaper::none && command.has('F');
        if (first) shaper.type = Shaper::zv;
        if (command.has('T')) shaper.type = static_cast<Shaper>(static_cast<int>(command.value('T')) + 1);
        if (command.has('P')) shaper.type = shaper_named(command.tail, shaper.type);
    }
}

void Compensation::shape_by_words(const CommandLine& command) {
    ++changes_;
    for (std::size_t axis = 0; axis < shapers_.size(); ++axis) {
        ShaperSpec& shaper = shapers_[axis];
        const std::string of_axis{'_', kAxisLetter[axis]};
        const auto frequency = command.word_number("SHAPER_FREQ" + of_axis);
        if (frequency) shaper.frequency_hz = *frequency;
        if (frequency && shaper.type == Shaper::none) shaper.type = Shaper::mzv;
        shaper.damping_ratio = command.word_number("DAMPING_RATIO" + of_axis).value_or(shaper.damping_ratio);
        const auto type = command.word_value("SHAPER_TYPE" + of_axis);
        const auto common = command.word_value("SHAPER_TYPE");
        if (type || common) shaper.type = shaper_named(type ? *type : *common, shaper.type);
    }
}

}  // namespace qduino::twin
