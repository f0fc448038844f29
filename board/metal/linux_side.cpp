#include "board/metal/linux_side.h"

#include <algorithm>

#include "board/metal/computer/clock.h"
#include "board/metal/pins.h"

namespace qduino::board::metal {

void LinuxSide::open(BesideArea& area) {
    constexpr Nanoseconds kShortest{200'000}, kLongest = 10ms;
    area_ = &area;
    const Nanoseconds limit{area.silence_limit_ns};
    interval_ = limit > Nanoseconds{0} ? std::clamp<Nanoseconds>(limit / 5, kShortest, kLongest) : kLongest;
    next_look_ = kEpoch;
    area.state.store(BesideState::booted, std::memory_order_release);
}

bool LinuxSide::look(Instant now) {
    if (!area_) return false;
    next_look_ = now + interval_;
    const std::uint64_t beats = area_->keeper_beats.load(std::memory_order_acquire);
    if (beats != beats_ || last_beat_ == kForever) last_beat_ = now;
    beats_ = beats;
    const Nanoseconds limit{area_->silence_limit_ns};
    if (was_silent_ || (limit > Nanoseconds{0} && now - last_beat_ > limit)) drive_safe_levels();
    area_->board_ns.store(to_ns(now), std::memory_order_relaxed);
    area_->board_beats.fetch_add(1, std::memory_order_release);
    area_->state.store(BesideState::runs, std::memory_order_release);
    return was_silent_ || area_->stop_asked.load(std::memory_order_acquire) != 0;
}

/// At each look from then on: a loop that was about to write a pin may do so once more.
void LinuxSide::drive_safe_levels() {
    pins.hold_safe_levels();
    if (was_silent_) return;
    was_silent_ = true;
    area_->last_beat_ns.store(to_ns(last_beat_), std::memory_order_relaxed);
    area_->safe_ns.store(to_ns(computer_clock.now()), std::memory_order_release);
}

bool LinuxSide::is_deaf(Instant now) const {
    return area_ && last_beat_ != kForever && now - last_beat_ > kDeaf;
}

bool LinuxSide::report(std::string_view text) {
    if (area_)
        area_->line.reports.push_some({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
    return area_ != nullptr;
}

void LinuxSide::tell_end(int status) {
    area_->status.store(static_cast<std::uint32_t>(status), std::memory_order_relaxed);
    area_->state.store(BesideState::ended, std::memory_order_release);
}

}  // namespace qduino::board::metal
