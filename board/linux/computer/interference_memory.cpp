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
    const auto [share, usual, burst, longest] = *found;
    return InterferenceFigures{std::min<std::int64_t>(share, 2'000'000), Nanoseconds{usual},
                               Nanoseconds{burst}, Nanoseconds{longest}};
}

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
    std::vector<InterferenceLook> looks;
    while (!text.empty()) {
        const auto line = words(cut(text, '\n'));
        if (line.empty()) continue;
        const auto rest = std::span{line}.subspan(1);
        if (const auto counted = figures(rest); counted && line[0] == "counted") memory.counted_ = *counted;
        if (const auto look = numbers<6>(rest, kMost.count()); look && line[0] == "look") {
            const auto [taken, usual, longest, worst, ticks, others] = *look;
            looks.push_back({Nanoseconds{taken}, Nanoseconds{usual}, Nanoseconds{longest}, Nanoseconds{worst},
                             ticks, others});
        }
    }
    memory.add(looks);
    return memory;
}

std::optional<InterferenceFigures> InterferenceMemory::figures_said(std::string_view text) {
    return figures(words(text));
}

void InterferenceMemory::add(const std::vector<InterferenceLook>& looks) {
    looks_.insert(looks_.end(), looks.begin(), looks.end());
    if (looks_.size() > kLooks)
        looks_.erase(looks_.begin(), looks_.end() - static_cast<std::ptrdiff_t>(kLooks));
}

Interference InterferenceMemory::interference() {
    const Interference known = interference_of(looks_, counted_);
    counted_ = known.counts;
    return known;
}

std::string InterferenceMemory::text() const {
    auto out = qduino::text<std::string>("counted ", counted_.share_ppm, ' ', counted_.usual.count(), ' ',
                                         counted_.burst.count(), ' ', counted_.longest.count(), '\n');
    for (InterferenceLook look : looks_) {
        look.worst = std::min(look.worst, kMost);  // the host may have stalled in the middle
        look.longest = std::min(look.longest, kMost);
        look.usual = std::min(look.usual, kMost);
        look.taken = std::min(look.taken, kMost);
        qduino::write(out, "look ", look.taken.count(), ' ', look.usual.count(), ' ', look.longest.count(),
                      ' ', look.worst.count(), ' ', look.ticks, ' ', look.others, '\n');
    }
    return out;
}

Result<void> InterferenceMemory::write(int core, const std::string& root) const {
    QDUINO_TRY_ASSIGN(const std::string folder, own_register(root));
    return posix::replace_guarded(path_in(folder, core), text(), 0644);
}

}  // namespace qduino::board::linux
