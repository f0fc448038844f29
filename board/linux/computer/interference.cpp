#include "board/linux/computer/interference.h"

#include <algorithm>

#include "board/linux/kernel/bare_spin.h"
#include "board/linux/kernel/core_times.h"
#include "board/linux/kernel/real_time_thread.h"

namespace qduino::board::linux {
namespace {

/// Two looks at the clock are some 50 ns apart. No interrupt is shorter than this.
constexpr Nanoseconds kGap = 1us;
/// The share of the looks' time above which the core is out of the ordinary.
constexpr std::int64_t kManyPpm = 100'000;

constexpr std::int64_t with_margin(std::int64_t found) { return found + found / 2; }

std::int64_t ppm_of(Nanoseconds taken, Nanoseconds length) {
    return length > Nanoseconds{0} ? taken.count() * 1'000'000 / length.count() : 0;
}

/// The value that `tenths` tenths of the values do not exceed; none: zero.
Nanoseconds quantile(std::vector<Nanoseconds> values, std::size_t tenths) {
    if (values.empty()) return {};
    const auto nth = values.begin() +
                     static_cast<std::ptrdiff_t>(std::min(values.size() - 1, values.size() * tenths / 10));
    std::nth_element(values.begin(), nth, values.end());
    return *nth;
}

std::vector<Nanoseconds> each_of(std::span<const InterferenceLook> looks,
                                 Nanoseconds InterferenceLook::*member) {
    std::vector<Nanoseconds> values;
    for (const InterferenceLook& look : looks) values.push_back(look.*member);
    return values;
}

Nanoseconds mean_but_the_worst(std::vector<Nanoseconds> values) {
    if (values.empty()) return {};
    std::ranges::sort(values);
    values.resize(values.size() - values.size() / 20);
    Nanoseconds sum{};
    for (const Nanoseconds each : values) sum += each;
    return sum / static_cast<std::int64_t>(values.size());
}

/// The length up to which the gaps, shortest first, take nine tenths of their time.
Nanoseconds usual_of(const std::vector<Nanoseconds>& sorted, Nanoseconds taken) {
    Nanoseconds sum{};
    for (const Nanoseconds gap : sorted) {
        sum += gap;
        if (sum >= taken * 9 / 10) return gap;
    }
    return {};
}

InterferenceLook look_at_gaps(std::vector<Nanoseconds>& gaps) {
    InterferenceLook seen;
    if (gaps.empty()) return seen;
    std::ranges::sort(gaps);
    for (const Nanoseconds gap : gaps) seen.taken += gap;
    seen.usual = usual_of(gaps, seen.taken);
    seen.longest = gaps.size() > 1 ? gaps[gaps.size() - 2] : gaps.back();
    seen.worst = gaps.back();
    return seen;
}

/// `gaps` is room for them.
InterferenceLook look_once(int core, std::vector<Nanoseconds>& gaps) {
    gaps.clear();
    const auto before = interrupt_counts_of(core);
    spin_and_look(kInterferenceLook, [&gaps](Nanoseconds between) {
        if (between > kGap && gaps.size() < gaps.capacity()) gaps.push_back(between);
    });
    const auto after = interrupt_counts_of(core);
    InterferenceLook seen = look_at_gaps(gaps);
    if (before && after) {
        seen.ticks = static_cast<std::int64_t>(after->ticks - before->ticks);
        seen.others = static_cast<std::int64_t>(after->others - before->others);
    }
    return seen;
}

std::int64_t kept_or_new(std::int64_t before, std::int64_t found) {
    return before >= found && before <= 2 * found ? before : with_margin(found);
}

Nanoseconds kept_or_new(Nanoseconds before, Nanoseconds found) {
    return Nanoseconds{kept_or_new(before.count(), found.count())};
}

}  // namespace

InterferenceFigures figures_of(std::span<const InterferenceLook> looks) {
    if (looks.empty()) return {};
    const auto taken = each_of(looks, &InterferenceLook::taken);
    const Nanoseconds mean = mean_but_the_worst(taken);
    return {.share_ppm = ppm_of(mean, kInterferenceLook),
            .usual = quantile(each_of(looks, &InterferenceLook::usual), 5),
            .burst = std::max(quantile(taken, 9) - Nanoseconds{with_margin(mean.count())}, Nanoseconds{0}),
            .longest = quantile(each_of(looks, &InterferenceLook::longest), 9)};
}

InterferenceFigures counted_for(const InterferenceFigures& found, const InterferenceFigures& before) {
    return {.share_ppm = kept_or_new(before.share_ppm, found.share_ppm),
            .usual = kept_or_new(before.usual, found.usual),
            .burst = kept_or_new(before.burst, found.burst),
            .longest = kept_or_new(before.longest, found.longest)};
}

sched::PlatformInterferer Interference::counted() const {
    sched::PlatformInterferer all{.name = "interrupts"};
    if (counts.share_ppm == 0) return all;
    all.cost = counts.usual;
    const std::int64_t usual = std::max<std::int64_t>(counts.usual.count(), 1);
    all.interval = std::max(Nanoseconds{usual * 1'000'000 / counts.share_ppm}, all.cost);
    // Two at once, or the burst.
    const Nanoseconds burst{counts.burst.count() * 1'000'000 / counts.share_ppm};
    all.jitter = std::max(all.interval, burst);
    return all;
}

sched::PlatformInterferer Interference::counted_once() const {
    return {.name = "longest interrupt",
            .cost = counts.longest,
            .interval = sched::kPeriodMax,
            .jitter = Nanoseconds{0}};
}

double Interference::counted_per_second() const {
    return each > Nanoseconds{0} ? static_cast<double>(counts.share_ppm) * 1e-6 / to_seconds(each) : 0;
}

Interference interference_of(std::span<const InterferenceLook> looks, const InterferenceFigures& before) {
    Interference all;
    if (looks.empty()) return all;
    all.measured = true;
    all.found = figures_of(looks);
    all.counts = counted_for(all.found, before);
    std::int64_t ticks = 0, others = 0;
    for (const InterferenceLook& look : looks) {
        ticks += look.ticks;
        others += look.others;
        all.worst = std::max(all.worst, look.worst);
    }
    const double length = static_cast<double>(looks.size()) * to_seconds(kInterferenceLook);
    all.ticks_per_second = static_cast<double>(ticks) / length;
    all.others_per_second = static_cast<double>(others) / length;
    if (ticks + others > 0) {
        const double taken = static_cast<double>(all.found.share_ppm) * 1e-6 * length;
        all.each = from_seconds(taken / static_cast<double>(ticks + others));
    }
    return all;
}

std::optional<InterferenceLook> look_of_run(const Interference& known, Nanoseconds length,
                                            std::uint64_t others) {
    if (!known.measured || known.each <= Nanoseconds{0} || length <= Nanoseconds{0}) return std::nullopt;
    const double look = to_seconds(kInterferenceLook);
    InterferenceLook seen;
    seen.ticks = static_cast<std::int64_t>(known.ticks_per_second * look);
    seen.others = static_cast<std::int64_t>(static_cast<double>(others) / to_seconds(length) * look);
    const Nanoseconds taken = (seen.ticks + seen.others) * known.each;
    seen.taken = std::min(taken, kInterferenceLook);
    // A run sees how many came, and not how long each was.
    seen.usual = known.found.usual;
    seen.longest = known.found.longest;
    seen.worst = known.found.longest;
    return seen;
}

std::vector<InterferenceLook> look_for_interference(int core, int priority, int count) {
    std::vector<InterferenceLook> looks;
    const bool ran = run_apart([&] {
        if (!pin_to_core(core) || !become_real_time(priority)) return;
        std::vector<Nanoseconds> gaps;
        gaps.reserve(4096);
        Nanoseconds taken{};
        const auto many = [&] {
            return ppm_of(taken, static_cast<std::int64_t>(looks.size()) * kInterferenceLook) > kManyPpm;
        };
        const auto most = static_cast<std::size_t>(3 * count);
        while (looks.size() < static_cast<std::size_t>(count) || (many() && looks.size() < most)) {
            looks.push_back(look_once(core, gaps));
            taken += looks.back().taken;
            block_until(monotonic_now() + kInterferenceLook / 2);
        }
    });
    if (!ran) looks.clear();
    return looks;
}

}  // namespace qduino::board::linux
