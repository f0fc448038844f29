#include "board/linux/computer/interference_memory.h"

#include <algorithm>
#include <array>
#include <optional>
#include <span>

#include "base/text.h"
#include "base/whole_number.h"
#include "board/linux/kernel/kernel_text.h"
#include "board/linux/kernel/shared_file.h"
#include "posix/guarded_file.h"

namespace qduino::board::linux {
namespace {

/// Nothing in a look is longer than that, and nothing that is counted of it.
constexpr Nanoseconds kMost = 2 * kInterferenceLook;

std::string path_in(const std::string& folder, int core) {
    return qduino::text<std::string>(folder, "/qduino-interrupts.", core);
}

/// All words, each from 0 to `highest`; nothing when there are not `count` such.
template <std::size_t count>
std::optional<std::array<std::int64_t, count>> numbers(std::span<const std::string_view> line,
                                                       std::int64_t highest) {
    std::array<std::int64_t, count> values{};
    if (line.size() != count) return std::nullopt;
    for (std::size_t i = 0; i < count; ++i) {
        const auto value = whole_number<std::int64_t>(line[i]);
        if (!value || *value < 0 || *value > highest) return std::nullopt;
        values[i] = *value;
    }
    return values;
}

std::optional<InterferenceFigures> figures(std::span<const std::string_view> line) {
    const auto found = numbers<4>(line, kMost.count());
    if (!found) return std::nullopt;
    const auto [share, burst, peak, peak_burst] = *found;
    constexpr std::int64_t kMostPpm = 2'000'000;
    return InterferenceFigures{std::min(share, kMostPpm), Nanoseconds{burst}, std::min(peak, kMostPpm),
                               Nanoseconds{peak_burst}};
}

std::optional<InterferenceLook> look(std::span<const std::string_view> line) {
    constexpr std::size_t kBefore = 4, kRates = kInterferenceRates.size();
    const auto found = numbers<kBefore + kRates>(line, kMost.count());
    if (!found) return std::nullopt;
    InterferenceLook look{.taken = Nanoseconds{(*found)[0]},
                          .worst = Nanoseconds{(*found)[1]},
                          .ticks = (*found)[2],
                          .others = (*found)[3]};
    for (std::size_t i = 0; i < kRates; ++i) look.bursts[i] = Nanoseconds{(*found)[kBefore + i]};
    return look;
}

void keep_newest(std::vector<InterferenceLook>& looks, std::size_t most) {
    if (looks.size() > most) looks.erase(looks.begin(), looks.end() - static_cast<std::ptrdiff_t>(most));
}

/// The host may have stalled in the middle: nothing is longer than what is read back.
std::int64_t at_most(Nanoseconds duration) { return std::min(duration, kMost).count(); }

}  // namespace

InterferenceMemory InterferenceMemory::read(int core, const std::string& root) {
    const auto own = own_register(root);
    for (const std::string& folder : believed_registers(root, own.ok() ? *own : "")) {
        if (const auto text = posix::read_guarded(path_in(folder, core), kRegisterFileBytesMax))
            return parse(*text);
    }
    return {};
}

InterferenceMemory InterferenceMemory::parse(std::string_view text) {
    InterferenceMemory memory;
    while (!text.empty()) {
        const auto line = words(cut(text, '\n'));
        if (line.empty()) continue;
        const auto rest = std::span{line}.subspan(1);
        if (const auto counts = figures(rest); counts && line[0] == "counts") memory.counted_ = *counts;
        if (const auto seen = look(rest); seen && line[0] == "look") memory.add({*seen});
        if (const auto seen = numbers<3>(rest, kMost.count()); seen && line[0] == "run")
            memory.add_run(
                {.taken = Nanoseconds{(*seen)[0]}, .worst = {}, .ticks = (*seen)[1], .others = (*seen)[2]},
                1);
    }
    return memory;
}

std::optional<InterferenceFigures> InterferenceMemory::figures_said(std::string_view text) {
    return figures(words(text));
}

void InterferenceMemory::add(const std::vector<InterferenceLook>& looks) {
    looks_.insert(looks_.end(), looks.begin(), looks.end());
    keep_newest(looks_, kLooks);
}

void InterferenceMemory::add_run(const InterferenceLook& look, std::size_t count) {
    runs_.insert(runs_.end(), count, look);
    keep_newest(runs_, kRuns);
}

Interference InterferenceMemory::interference() {
    const Interference known = interference_of(looks_, runs_, counted_);
    counted_ = known.counts;
    return known;
}

std::string InterferenceMemory::text() const {
    auto out = qduino::text<std::string>("counts ", counted_.share_ppm, ' ', at_most(counted_.burst), ' ',
                                         counted_.peak_ppm, ' ', at_most(counted_.peak_burst), '\n');
    for (const InterferenceLook& look : looks_) {
        qduino::write(out, "look ", at_most(look.taken), ' ', at_most(look.worst), ' ', look.ticks, ' ',
                      look.others);
        for (const Nanoseconds burst : look.bursts) qduino::write(out, ' ', at_most(burst));
        out += '\n';
    }
    for (const InterferenceLook& run : runs_)
        qduino::write(out, "run ", at_most(run.taken), ' ', run.ticks, ' ', run.others, '\n');
    return out;
}

Result<void> InterferenceMemory::write(int core, const std::string& root) const {
    QDUINO_TRY_ASSIGN(const std::string folder, own_register(root));
    return posix::replace_guarded(path_in(folder, core), text(), 0644);
}

}  // namespace qduino::board::linux
