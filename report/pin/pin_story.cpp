#include "report/pin/pin_story.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "terminal/human.h"

namespace qduino::apps {
namespace {

/// What people hear, 20 Hz to 20 kHz.
constexpr Nanoseconds kHighestTone = 50us, kLowestTone = 50ms;

/// Three decimals, which for milliseconds are microseconds: "500.000 ms".
std::string fine(Nanoseconds length) {
    const auto ns = static_cast<double>(length.count());
    if (length < 1us) return text<std::string>(length.count(), " ns");
    if (length < 1ms) return text<std::string>(Fixed{ns / 1e3, 3}, " us");
    if (length < 10s) return text<std::string>(Fixed{ns / 1e6, 3}, " ms");
    return text<std::string>(Fixed{ns / 1e9, 3}, " s");
}

std::string hertz(Nanoseconds period) {
    const double hz = 1e9 / static_cast<double>(std::max<std::int64_t>(period.count(), 1));
    return text<std::string>(Fixed{hz, hz < 1000 ? 1 : 0}, " Hz");
}

std::string percent(double share) { return text<std::string>(Fixed{share * 100, 1}, " %"); }

}  // namespace

// ---- stretches ----------------------------------------------------------------------------------

void Spread::add(Nanoseconds length) {
    shortest_ = count_ == 0 ? length : std::min(shortest_, length);
    longest_ = count_ == 0 ? length : std::max(longest_, length);
    sum_ns_ += static_cast<double>(length.count());
    ++count_;
}

Nanoseconds Spread::mean() const {
    if (count_ == 0) return Nanoseconds{0};
    return Nanoseconds{std::llround(sum_ns_ / static_cast<double>(count_))};
}

std::string Spread::words(bool with_deviation) const {
    const Nanoseconds deviation = std::max(longest_ - mean(), mean() - shortest_);
    if (deviation > mean() / 20) return human_duration(shortest_) + " … " + human_duration(longest_);
    if (!with_deviation) return fine(mean());
    return fine(mean()) + " ± " + (deviation == Nanoseconds{0} ? "0" : human_duration(deviation));
}

// ---- what is told -------------------------------------------------------------------------------

void PinStory::level(Instant now, bool high) {
    told_ = true;
    if (high_ == high) return;
    if (high_ == true) end_pulse(now);
    if (high) {
        if (last_rise_) {
            const Nanoseconds period = now - *last_rise_;
            periods_.add(period);
            widths_.add(last_width_);
            const Nanoseconds uneven = last_width_ * 2 - period;
            const bool even = std::max(uneven, -uneven) <= period / 50;
            if (even && period >= kHighestTone && period <= kLowestTone) tones_.add(period);
        }
        last_rise_ = now;
    }
    high_ = high;
    since_ = last_change_ = now;
}

void PinStory::end_pulse(Instant now) {
    last_width_ = now - since_;
    ++pulses_;
}

void PinStory::duty(Instant now, double duty) {
    if (duty <= 0 || duty >= 1) {
        level(now, duty >= 1);
    } else {
        told_ = pwm_ = true;
        if (high_ == true) end_pulse(now);
        high_.reset();
    }
    if (duty == duty_) return;
    duty_changes_ += duty_ >= 0 ? 1 : 0;
    duty_ = duty;
    last_change_ = now;
    least_duty_ = std::min(least_duty_, duty);
    most_duty_ = std::max(most_duty_, duty);
}

void PinStory::released(Instant now) {
    if (high_ == true) end_pulse(now);
    if (told_) last_change_ = now;
    high_.reset();
}

// ---- what is said -------------------------------------------------------------------------------

std::string PinStory::sentence(Instant origin) const {
    if (!told_) return "never driven";
    if (pwm_) return pwm_said();
    if (pulses() > 0) {
        const std::string tone = tone_said();
        return (tone.empty() ? pulses_said(origin) : tone) + (high_ == true ? ", high at the end" : "");
    }
    if (!high_) return "an input at the end, without a pulse before";
    if (!*high_) return "low all the time";
    if (since_ == origin) return "high all the time";
    return "high from " + fine(since_ - origin) + " on";
}

std::string PinStory::pulses_said(Instant origin) const {
    if (periods_.count() == 0)
        return text<std::string>("1 pulse of ", fine(last_width_), ", at ", fine(*last_rise_ - origin));
    return text<std::string>(counted(pulses(), "pulse"), ", period ", periods_.words(true), ", each ",
                             widths_.words(false));
}

/// Nearly all pulses are as long as the pause behind them: a melody has rests.
std::string PinStory::tone_said() const {
    if (tones_.count() < 8 || tones_.count() * 10 < periods_.count() * 9) return {};
    const std::string low = hertz(tones_.longest()), high = hertz(tones_.shortest());
    return text<std::string>(counted(pulses(), "pulse"), ", ",
                             low == high ? "a tone of " + low : "tones of " + low + " … " + high);
}

std::string PinStory::pwm_said() const {
    std::string words = "PWM";
    if (pwm_period_ > Nanoseconds{0}) write(words, " of ", fine(pwm_period_));
    const auto amount = [this](double duty) {
        return pwm_period_ > Nanoseconds{0}
                   ? percent(duty) + " (" +
                         human_duration(
                             Nanoseconds{std::llround(duty * static_cast<double>(pwm_period_.count()))}) +
                         ")"
                   : percent(duty);
    };
    write(words, ", duty ", amount(least_duty_));
    if (most_duty_ > least_duty_) write(words, " … ", amount(most_duty_));
    if (duty_changes_ > 0) write(words, ", changed ", duty_changes_, duty_changes_ == 1 ? " time" : " times");
    return words;
}

}  // namespace qduino::apps
