#include "report/pin/pin_witness.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "posix/system_error.h"

namespace qduino::apps {
namespace {

using board::Level;
using board::PinId;

constexpr std::size_t kSpillAt = 1 << 20;
/// So many periods of the slowest pin are worth a longer window.
constexpr int kPeriodsShown = 3;

}  // namespace

Result<void> PinWitness::keep_dump() {
    body_.reset(std::tmpfile());
    if (!body_) return posix::system_error("make", "a temporary file for the pins' changes");
    return {};
}

bool PinWitness::begins(Instant now) {
    if (end_) return false;
    if (!origin_) origin_ = now;
    return true;
}

void PinWitness::end(Instant now) {
    if (!begins(now)) return;
    end_ = now;
    if (body_) dump_.end(since_origin(now));
    spill();
}

void PinWitness::pin_written(Instant now, PinId pin, Level level) {
    ForwardingPeripherals::pin_written(now, pin, level);
    if (!begins(now)) return;
    const bool high = level == Level::high;
    stories_[pin.number].level(now, high);
    keep(now, pin, high ? 1 : 0);
    if (body_) dump_.level(since_origin(now), pin.number, high ? '1' : '0');
    if (dump_.held() >= kSpillAt) spill();
}

void PinWitness::pin_released(Instant now, PinId pin) {
    ForwardingPeripherals::pin_released(now, pin);
    if (!begins(now) || !stories_[pin.number].told()) return;
    stories_[pin.number].released(now);
    keep(now, pin, -1);
    if (body_) dump_.level(since_origin(now), pin.number, 'z');
}

void PinWitness::pwm_written(Instant now, PinId pin, double duty) {
    ForwardingPeripherals::pwm_written(now, pin, duty);
    if (!begins(now)) return;
    stories_[pin.number].duty(now, duty);
    keep(now, pin, static_cast<float>(duty));
    if (!body_) return;
    dump_.level(since_origin(now), pin.number, duty <= 0 ? '0' : duty >= 1 ? '1' : 'x');
    dump_.duty(since_origin(now), pin.number, duty);
    if (dump_.held() >= kSpillAt) spill();
}

void PinWitness::pwm_period_set(Instant now, PinId pin, Nanoseconds period) {
    ForwardingPeripherals::pwm_period_set(now, pin, period);
    if (begins(now)) stories_[pin.number].pwm_period(period);
}

void PinWitness::keep(Instant now, PinId pin, float height) {
    if (since_origin(now) <= rows_from_.count()) {
        before_[pin.number] = height;
        return;
    }
    if (changes_.size() >= kKept) {
        kept_until_ = std::min(kept_until_, now);
        return;
    }
    changes_.push_back({now, pin.number, height});
}

bool PinWitness::empty() const {
    return std::ranges::none_of(stories_, [](const PinStory& story) { return story.told(); });
}

// ---- sentences ----------------------------------------------------------------------------------

std::string PinWitness::sentences() const {
    std::string lines;
    std::size_t said = 0, more = 0;
    for (std::size_t pin = 0; pin < stories_.size(); ++pin) {
        if (!stories_[pin].told()) continue;
        if (said == kSentences) {
            ++more;
            continue;
        }
        ++said;
        write(lines, "pin ", pin, ": ", stories_[pin].sentence(origin()), '\n');
    }
    if (more > 0) write(lines, "and ", more, " more\n");
    return lines;
}

// ---- rows ---------------------------------------------------------------------------------------

/// On the run's own clock.
Instant PinWitness::window_end(const picture::Schedule& schedule, Instant origin) const {
    const Instant from = origin + (schedule.from - kEpoch);
    Instant until = origin + (schedule.until - kEpoch);
    for (const PinStory& story : stories_) {
        if (!story.told()) continue;
        const Nanoseconds needed = story.periods().count() > 0
                                       ? story.periods().mean() * kPeriodsShown
                                       : std::max(story.last_change() - from, Nanoseconds{0}) * 5 / 4;
        until = std::max(until, from + needed);
    }
    return std::min({until, kept_until_, std::max(end_.value_or(until), from + Nanoseconds{1})});
}

void PinWitness::add_rows(picture::Schedule& schedule, Instant origin, bool may_choose) const {
    const Instant from = origin + (schedule.from - kEpoch);
    const Instant until =
        may_choose ? window_end(schedule, origin) : std::min(origin + (schedule.until - kEpoch), kept_until_);
    if (until <= from) return;
    schedule.pins_until = kEpoch + (until - origin);
    std::array<std::vector<picture::PinStretch>, board::kPinCount> stretches;
    const auto end_last = [&](std::vector<picture::PinStretch>& all, Instant now) {
        if (!all.empty()) all.back().until = kEpoch + (now - origin);
    };
    const auto add = [&](std::size_t pin, Instant at, float height) {
        std::vector<picture::PinStretch>& all = stretches[pin];
        if (!all.empty() && all.back().height == height) return;
        end_last(all, at);
        all.push_back({.from = kEpoch + (at - origin), .until = {}, .height = height});
    };
    for (std::size_t pin = 0; pin < before_.size(); ++pin) {
        if (before_[pin]) add(pin, from, *before_[pin]);
    }
    for (const Change& change : changes_) {
        if (change.at >= until) break;
        add(change.pin, std::max(change.at, from), change.height);
    }
    for (std::size_t pin = 0; pin < stretches.size(); ++pin) {
        if (!stories_[pin].told()) continue;
        end_last(stretches[pin], until);
        std::erase_if(stretches[pin], [](const picture::PinStretch& s) { return s.height < 0; });
        schedule.pins.push_back({.name = text<std::string>("pin ", pin),
                                 .remark = stories_[pin].sentence(this->origin()),
                                 .stretches = std::move(stretches[pin])});
    }
}

// ---- the dump -----------------------------------------------------------------------------------

void PinWitness::spill() {
    if (!body_) return;
    const std::string piece = dump_.take_body();
    spilled_ = std::fwrite(piece.data(), 1, piece.size(), body_.get()) == piece.size() && spilled_;
}

Result<void> PinWitness::write_dump(const std::string& path) {
    spill();
    const auto failed = [&] { return posix::system_error("write the pins' changes to", path); };
    const std::unique_ptr<std::FILE, CloseFile> file{std::fopen(path.c_str(), "w")};
    if (!file || !body_ || !spilled_) return failed();
    const std::string head = dump_.head();
    bool written = std::fwrite(head.data(), 1, head.size(), file.get()) == head.size();
    std::rewind(body_.get());
    std::vector<char> piece(kSpillAt);
    while (written) {
        const std::size_t count = std::fread(piece.data(), 1, piece.size(), body_.get());
        if (count == 0) break;
        written = std::fwrite(piece.data(), 1, count, file.get()) == count;
    }
    written = written && std::ferror(body_.get()) == 0 && std::fflush(file.get()) == 0;
    return written ? Result<void>{} : failed();
}

}  // namespace qduino::apps
