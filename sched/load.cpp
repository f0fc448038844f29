#include "sched/load.h"

#include "base/contract.h"
#include "sched/exact.h"

namespace qduino::sched {

Nanoseconds PlatformInterferer::interference(Nanoseconds window) const {
    if (cost <= Nanoseconds{0} || window <= Nanoseconds{0}) return Nanoseconds{0};
    QDUINO_EXPECT(interval > Nanoseconds{0} && jitter >= Nanoseconds{0});
    return div_ceil((window + jitter).count(), interval.count()) * cost;
}

Nanoseconds PlatformOverheads::interference(Nanoseconds window) const {
    Nanoseconds sum{0};
    for (const PlatformInterferer& interferer : interferers) sum += interferer.interference(window);
    return sum;
}

}  // namespace qduino::sched
