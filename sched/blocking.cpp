#include "sched/blocking.h"

#include <algorithm>

#include "base/contract.h"

namespace qduino::sched {

Nanoseconds longest_overrun(std::span<const CriticalSection> sections, VcpuId holder) {
    const auto is_shared = [&](const CriticalSection& own) {
        return std::ranges::any_of(sections, [&](const CriticalSection& other) {
            return other.loop != holder && other.lock == own.lock && other.length > Nanoseconds{0};
        });
    };
    Nanoseconds sum{};
    for (const CriticalSection& section : sections) {
        if (section.loop == holder && is_shared(section)) sum += section.length;
    }
    return sum;
}

int requests_of(std::span<const CriticalSection> sections, VcpuId loop) {
    return static_cast<int>(std::ranges::count_if(sections, [loop](const CriticalSection& section) {
        return section.loop == loop && section.length > Nanoseconds{0} && !section.assumed;
    }));
}

Blocking::Blocking(std::span<const VcpuId> by_rank, std::span<const CriticalSection> sections,
                   std::span<const VcpuId> handlers)
    : loops_(by_rank.size()) {
    QDUINO_EXPECT(loops_ <= kMainVcpuLimit);
    for (const VcpuId handler : handlers) handlers_.push_back({.id = handler});
    for (const CriticalSection& section : sections) {
        if (auto* const handler = std::ranges::find(handlers_, section.loop, &Handler::id);
            handler != handlers_.end()) {
            handler->locks |= LockSet{1} << section.lock;
            by_handlers_[section.lock] += section.length;
        }
        const auto place = std::find(by_rank.begin(), by_rank.end(), section.loop);
        if (place == by_rank.end()) continue;
        const auto i = static_cast<std::size_t>(place - by_rank.begin());
        locks_of_[i] |= LockSet{1} << section.lock;
        ++requests_[i];
        longest_[i][section.lock] = std::max(longest_[i][section.lock], section.length);
    }
}

/// The locks of loop i and of those above it, handlers among them, and those at the end of a chain
/// from there.
LockSet Blocking::that_block(std::size_t i) const {
    LockSet locks = 0;
    for (const Handler& handler : handlers_) locks |= handler.locks;
    for (std::size_t j = 0; j <= i; ++j) locks |= locks_of_[j];
    return chained_with(locks, [&](auto visit) {
        for (std::size_t j = i + 1; j < loops_; ++j) visit(locks_of_[j]);
    });
}

Nanoseconds Blocking::of(std::size_t i) const {
    const LockSet locks = that_block(i);
    Nanoseconds by_loop{};
    std::array<Nanoseconds, kLockLimit> of_lock{};
    for (std::size_t j = i + 1; j < loops_; ++j) {
        Nanoseconds of_loop{};
        for (std::size_t lock = 0; lock < kLockLimit; ++lock) {
            if (!(locks >> lock & 1)) continue;
            of_loop = std::max(of_loop, longest_[j][lock]);
            of_lock[lock] = std::max(of_lock[lock], longest_[j][lock]);
        }
        by_loop += of_loop;
    }
    Nanoseconds by_lock{};
    for (const Nanoseconds length : of_lock) by_lock += length;
    return std::min(by_loop, by_lock);
}

/// All that a chain from `locks` may reach.
LockSet Blocking::connected_with(LockSet locks) const {
    return chained_with(locks, [&](auto visit) {
        for (std::size_t j = 0; j < loops_; ++j) visit(locks_of_[j]);
        for (const Handler& handler : handlers_) visit(handler.locks);
    });
}

Nanoseconds Blocking::by_handlers(std::size_t i) const {
    const LockSet locks = connected_with(locks_of_[i]);
    Nanoseconds sum{};
    for (std::size_t lock = 0; lock < kLockLimit; ++lock) {
        if (locks >> lock & 1) sum += by_handlers_[lock];
    }
    return requests_[i] * sum;
}

Nanoseconds Blocking::of_handler(VcpuId handler) const {
    const auto* const self = std::ranges::find(handlers_, handler, &Handler::id);
    if (self == handlers_.end()) return Nanoseconds{0};
    const LockSet locks = connected_with(self->locks);
    Nanoseconds sum{};
    for (std::size_t lock = 0; lock < kLockLimit; ++lock) {
        if (!(locks >> lock & 1)) continue;
        Nanoseconds longest{};
        for (std::size_t j = 0; j < loops_; ++j) longest = std::max(longest, longest_[j][lock]);
        sum += longest;
    }
    return sum;
}

}  // namespace qduino::sched
