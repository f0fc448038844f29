#include "report/picture/ticks.h"

#include <cstdint>

#include "base/contract.h"
#include "base/text.h"

namespace qduino::apps::picture {

Nanoseconds tick_step(Nanoseconds length, int most) {
    QDUINO_EXPECT(length > Nanoseconds{0} && most >= 2);
    for (std::int64_t power = 1;; power *= 10) {
        for (const std::int64_t factor : {1, 2, 5}) {
            const Nanoseconds step{factor * power};
            if (length / step + 1 <= most) return step;
        }
    }
}

std::vector<Instant> ticks(Instant from, Instant until, Nanoseconds step) {
    std::int64_t first = to_ns(from) / step.count();
    while (first * step.count() < to_ns(from)) ++first;
    std::vector<Instant> found;
    for (Instant at = instant_from_ns(first * step.count()); at <= until; at += step) found.push_back(at);
    return found;
}

std::string tick_label(Instant at, Nanoseconds step) {
    struct Unit {
        std::int64_t ns;
        const char* name;
    };
    constexpr Unit kUnits[] = {{1'000'000'000, " s"}, {1'000'000, " ms"}, {1000, " us"}, {1, " ns"}};
    const std::int64_t ns = to_ns(at);
    if (ns == 0) return "0";
    // The largest unit of which a step is at least a tenth.
    const Unit* unit = kUnits;
    while (unit->ns > 1 && step.count() * 10 < unit->ns) ++unit;
    const bool whole = step.count() % unit->ns == 0;
    return text<std::string>(Fixed{static_cast<double>(ns) / static_cast<double>(unit->ns), whole ? 0 : 1},
                             unit->name);
}

}  // namespace qduino::apps::picture
