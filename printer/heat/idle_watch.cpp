#include "printer/heat/idle_watch.h"

#include <algorithm>

namespace qduino::printer::heat {

/// True when a heater above its target has cooled by another kCoolingStep since the last time that
/// counted.
bool IdleWatch::comes_nearer(std::size_t which, const HeatUse::Heater& heater) {
    if (heater.target_celsius != targets_[which]) {
        targets_[which] = heater.target_celsius;
        nearest_[which] = heater.celsius;
        return false;
    }
    const bool above = heater.target_celsius > 0 && heater.celsius > heater.target_celsius;
    if (!above || heater.celsius > nearest_[which] - kCoolingStep) return false;
    nearest_[which] = heater.celsius;
    return true;
}

bool IdleWatch::is_used(const HeatUse& use) {
    bool used = use.pulses != pulses_ || use.requests != requests_;
    pulses_ = use.pulses;
    requests_ = use.requests;
    for (std::size_t i = 0; i < use.heaters.size(); ++i) {
        const bool nearer = comes_nearer(i, use.heaters[i]);
        used = used || nearer || (use.heaters[i].target_celsius > 0 && use.heaters[i].heating_up);
    }
    return used;
}

bool IdleWatch::sample(Instant now, const HeatUse& use) {
    const bool asked = use.requests != requests_;
    const bool used = is_used(use);
    const bool on = std::ranges::any_of(
        use.heaters, [](const HeatUse::Heater& heater) { return heater.target_celsius > 0; });
    if (asked) timed_out_ = false;
    if (!started_ || used || !on) used_ = now;
    started_ = true;
    left_.reset();
    if (timeout_ <= Nanoseconds{0} || timed_out_) return timed_out_;
    const Nanoseconds unused = now - used_;
    timed_out_ = unused >= timeout_;
    if (!timed_out_ && unused >= std::min(kQuiet, timeout_ / 2)) left_ = timeout_ - unused;
    return timed_out_;
}

}  // namespace qduino::printer::heat
