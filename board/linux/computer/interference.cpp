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
/// So many rates above the share's is the peak's: 2.5 times as high.
constexpr std::size_t kPeakAbove = 2;
/// Admission counts what is taken in steps of this.
constexpr Nanoseconds kStep = 10us;

constexpr Nanoseconds with_margin(Nanoseconds found) { return found + found / 4; }

std::int64_t ppm_of(Nanoseconds taken, Nanoseconds length) {
    return length > Nanoseconds{0} ? taken.count() * 1'000'000 / length.count() : 0;
}

Nanoseconds mean_but_the_worst(std::vector<Nanoseconds> values) {
    if (values.empty()) return {};
    std::ranges::sort(values);
    values.resize(values.size() - values.size() / 20);
    Nanoseconds sum{};
    for (const Nanoseconds each : values) sum += each;
    return sum / static_cast<std::int64_t>(values.size());
}

/// Where a rate stands; the last one where all are below it.
std::size_t rate_at(std::int64_t ppm) {
    const auto found = std::ranges::lower_bound(kInterferenceRates, ppm);
    return std::min(static_cast<std::size_t>(found - kInterferenceRates.begin()),
                    kInterferenceRates.size() - 1);
}

/// The burst of one rate, of all looks.
class Bursts {
  public:
    Bursts(std::span<const InterferenceLook> looks, std::size_t rate) {
        for (const InterferenceLook& look : looks) values_.push_back(look.bursts[rate]);
        std::ranges::sort(values_);
    }
    /// Nine in ten looks stayed within it.
    [[nodiscard]] Nanoseconds found() const { return values_.empty() ? Nanoseconds{0} : values_[ninth()]; }
    /// What is counted from now on, where `before` was counted.
    [[nodiscard]] Nanoseconds counted(Nanoseconds before) const {
        return many_have_more_than(before) || few_have_more_than(before / 2) ? with_margin(found()) : before;
    }

  private:
    [[nodiscard]] std::size_t ninth() const { return std::min(values_.size() - 1, values_.size() * 9 / 10); }
    [[nodiscard]] std::int64_t count_beyond(Nanoseconds limit) const {
        return values_.end() - std::ranges::upper_bound(values_, limit);
    }
    /// A tenth of n looks have more, as a rule, and by chance up to two standard deviations beside
    /// that, √(0.09·n) each.
    [[nodiscard]] bool many_have_more_than(Nanoseconds limit) const {
        const auto n = static_cast<std::int64_t>(values_.size());
        const std::int64_t more = 10 * count_beyond(limit) - n - 10;  // tenths of a look
        return more > 0 && more * more > 36 * n;
    }
    [[nodiscard]] bool few_have_more_than(Nanoseconds limit) const {
        const auto n = static_cast<std::int64_t>(values_.size());
        const std::int64_t less = n - 10 - 10 * count_beyond(limit);
        return less > 0 && less * less > 36 * n;
    }

    std::vector<Nanoseconds> values_;
};

/// A fifth above the mean, at the least, and less than twice it.
std::int64_t share_to_count(std::int64_t found) {
    const std::int64_t more = found + found / 5;
    return std::max(more, kInterferenceRates[rate_at(more)]);
}

InterferenceFigures counted_for(std::span<const InterferenceLook> looks, std::int64_t found_ppm,
                                const InterferenceFigures& before) {
    if (found_ppm == 0) return {};
    InterferenceFigures counts = before;
    const bool stays = before.share_ppm >= found_ppm && before.share_ppm <= 2 * found_ppm;
    if (!stays) counts.share_ppm = share_to_count(found_ppm);
    // A rate that none of the list is below has the burst of the last one, which is no less.
    const std::size_t at = rate_at(counts.share_ppm);
    const std::size_t peak = std::min(at + kPeakAbove, kInterferenceRates.size() - 1);
    counts.peak_ppm = std::max(kInterferenceRates[peak], counts.share_ppm);
    const Bursts bursts{looks, at}, peaks{looks, peak};
    const bool same = stays && before.peak_ppm == counts.peak_ppm;
    counts.burst = same ? bursts.counted(before.burst) : with_margin(bursts.found());
    counts.peak_burst = same ? peaks.counted(before.peak_burst) : with_margin(peaks.found());
    return counts;
}

/// It is taken as if it had all the bursts of its rates.
bool is_stall(const InterferenceLook& look, const InterferenceFigures& counts) {
    return look.bursts[rate_at(counts.share_ppm)] > counts.burst ||
           (counts.peak_ppm > 0 && look.bursts[rate_at(counts.peak_ppm)] > counts.peak_burst);
}

InterferenceLook look_once(int core) {
    const auto before = interrupt_counts_of(core);
    InterferenceGaps gaps;
    spin_and_look(kInterferenceLook, [&gaps](Nanoseconds between) { gaps.add(between); });
    const auto after = interrupt_counts_of(core);
    InterferenceLook seen = gaps.look();
    if (before && after) {
        seen.ticks = static_cast<std::int64_t>(after->ticks - before->ticks);
        seen.others = static_cast<std::int64_t>(after->others - before->others);
    }
    return seen;
}

/// Time between two events of kStep each that take `ppm` of the core.
Nanoseconds interval_of(std::int64_t ppm) {
    return std::max(Nanoseconds{kStep.count() * 1'000'000 / ppm}, kStep);
}

/// In which `burst` is taken at that rate, rounded up.
Nanoseconds jitter_of(Nanoseconds burst, std::int64_t ppm) {
    return Nanoseconds{burst.count() * 1'000'000 / ppm + 1};
}

}  // namespace

void InterferenceGaps::add(Nanoseconds between) {
    if (between <= kGap) {
        since_gap_ += between;
        return;
    }
    look_.taken += between;
    look_.worst = std::max(look_.worst, between);
    const auto gap = static_cast<double>(between.count()), before = static_cast<double>(since_gap_.count());
    for (std::size_t i = 0; i < held_.size(); ++i) {
        const double rate = static_cast<double>(kInterferenceRates[i]) * 1e-6;
        held_[i] = std::max(held_[i] - before * rate, 0.0) + gap * (1 - rate);
        look_.bursts[i] = std::max(look_.bursts[i], Nanoseconds{static_cast<std::int64_t>(held_[i]) + 1});
    }
    since_gap_ = Nanoseconds{0};
}

sched::PlatformInterferer Interference::counted() const {
    sched::PlatformInterferer all{.name = "interrupts"};
    if (counts.share_ppm == 0) return all;
    all.cost = kStep;
    all.interval = interval_of(counts.share_ppm);
    all.jitter = jitter_of(counts.burst, counts.share_ppm);
    if (counts.peak_ppm == 0) return all;
    all.peak_interval = interval_of(counts.peak_ppm);
    all.peak_jitter = jitter_of(counts.peak_burst, counts.peak_ppm);
    return all;
}

double Interference::counted_per_second() const {
    return each > Nanoseconds{0} ? static_cast<double>(counts.share_ppm) * 1e-6 / to_seconds(each) : 0;
}

Interference interference_of(std::span<const InterferenceLook> looks, std::span<const InterferenceLook> runs,
                             const InterferenceFigures& before) {
    Interference all;
    if (looks.empty()) return all;
    all.measured = true;
    all.looks = looks.size();
    std::vector<Nanoseconds> taken;
    std::int64_t ticks = 0, others = 0;
    for (const auto kind : {looks, runs}) {
        for (const InterferenceLook& look : kind) {
            taken.push_back(look.taken);
            ticks += look.ticks;
            others += look.others;
            all.worst = std::max(all.worst, look.worst);
        }
    }
    const double length = static_cast<double>(taken.size()) * to_seconds(kInterferenceLook);
    all.found_ppm = ppm_of(mean_but_the_worst(std::move(taken)), kInterferenceLook);
    all.counts = counted_for(looks, all.found_ppm, before);
    all.stalls = static_cast<std::size_t>(std::ranges::count_if(
        looks, [&](const InterferenceLook& look) { return is_stall(look, all.counts); }));
    all.ticks_per_second = static_cast<double>(ticks) / length;
    all.others_per_second = static_cast<double>(others) / length;
    if (ticks + others > 0) {
        const double sum = static_cast<double>(all.found_ppm) * 1e-6 * length;
        all.each = from_seconds(sum / static_cast<double>(ticks + others));
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
    seen.taken = std::min((seen.ticks + seen.others) * known.each, kInterferenceLook);
    return seen;
}

std::vector<InterferenceLook> look_for_interference(int core, int priority, int count) {
    std::vector<InterferenceLook> looks;
    const bool ran = run_apart([&] {
        if (!pin_to_core(core) || !become_real_time(priority)) return;
        Nanoseconds taken{};
        const auto many = [&] {
            return ppm_of(taken, static_cast<std::int64_t>(looks.size()) * kInterferenceLook) > kManyPpm;
        };
        const auto most = static_cast<std::size_t>(3 * count);
        looks.reserve(most);
        while (looks.size() < static_cast<std::size_t>(count) || (many() && looks.size() < most)) {
            looks.push_back(look_once(core));
            taken += looks.back().taken;
            block_until(monotonic_now() + kInterferenceLook / 2);
        }
    });
    if (!ran) looks.clear();
    return looks;
}

}  // namespace qduino::board::linux
