#include "apps/launcher/restart_policy.h"

#include <algorithm>
#include <utility>

namespace qduino::launcher {

std::optional<Nanoseconds> RestartPolicy::on_end(const Ended& ended, Nanoseconds lived) {
    ever_ready_ = ever_ready_ || ended.was_ready;
    const bool said_why = !ended.killed() && !ended.was_ready;
    errors_in_a_row_ = said_why ? errors_in_a_row_ + 1 : 0;
    if (!ended.killed() && ended.status == 0) return std::nullopt;
    if (said_why && (!ever_ready_ || errors_in_a_row_ >= kErrorsInARow)) return std::nullopt;
    if (lived >= kGoodLife) pause_ = kFirstPause;
    return std::exchange(pause_, std::min(2 * pause_, kLastPause));
}

}  // namespace qduino::launcher
