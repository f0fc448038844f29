#include "board/linux/computer/delay_witness.h"

#include <unistd.h>

#include <algorithm>
#include <utility>

#include "board/linux/kernel/control_groups.h"

namespace qduino::board::linux {

void DelayWitness::begin(Instant now, const std::vector<Ward>& wards) {
    began_ = looked_at_ = now;
    quota_then_ = kept_waiting_by_quota(root_).value_or(Nanoseconds{0});
    for (const Ward& ward : wards) {
        if (std::ranges::count(cores_, ward.core, &Core::core) == 0) add_core(ward.core);
        Watched& watched = watched_.emplace_back();
        watched.found.id = ward.id;
        watched.found.core = ward.core;
        watched.found.owns_core = ward.owns_core;
        watched.before = ward;
        watched.told = watched.times.open(::getpid(), ward.tid) && watched.times.read(watched.then);
    }
}

void DelayWitness::add_core(int core) {
    Core& added = cores_.emplace_back();
    added.core = core;
    added.first = added.then = core_times(core, root_);
}

Nanoseconds DelayWitness::taken_of(int core) const {
    const auto found = std::ranges::find(cores_, core, &Core::core);
    if (found == cores_.end()) return Nanoseconds{0};
    const auto since = [&](std::optional<Nanoseconds> CoreTimes::*what) {
        return (found->then.*what).value_or(Nanoseconds{0}) - (found->first.*what).value_or(Nanoseconds{0});
    };
    return since(&CoreTimes::host) + since(&CoreTimes::interrupted);
}

void DelayWitness::look(Instant now, const std::vector<Ward>& wards, Nanoseconds stood_still) {
    const Nanoseconds quota = kept_waiting_by_quota(root_).value_or(quota_then_);
    quota_ = quota - std::exchange(quota_then_, quota);
    // A task that has spent its quota waits for no core, either.
    stood_still_ = std::max(stood_still - quota_, Nanoseconds{0});
    for (Core& core : cores_) core.now = core_times(core.core, root_);
    for (std::size_t i = 0; i < std::min(wards.size(), watched_.size()); ++i) {
        Watched& watched = watched_[i];
        const Ward& ward = wards[i];
        sched::ThreadTimes times = watched.then;
        watched.told = watched.told && watched.times.read(times);
        const std::int64_t late = ward.late - watched.before.late;
        const bool worse = ward.worst > watched.found.worst;
        if (late > 0 || worse) {
            DelayGuarantee lately = judge(watched, ward, now, times.delayed - watched.then.delayed);
            lately.worst = std::max(ward.worst_lately, worse ? ward.worst : Nanoseconds{0});
            lately.late = watched.found.late;
            lately.late[static_cast<std::size_t>(cause_of(lately))] += late;
            watched.found.late = lately.late;
            if (worse) watched.found = lately;
        }
        watched.then = times;
        watched.before = ward;
    }
    for (Core& core : cores_) core.then = std::move(core.now);
    looked_at_ = now;
}

/// What the kernel, and the loop's own keeper, have counted since the last look.
DelayGuarantee DelayWitness::judge(const Watched& watched, const Ward& ward, Instant now,
                                   Nanoseconds waited) const {
    const auto since = [](const std::optional<Nanoseconds>& then, const std::optional<Nanoseconds>& later) {
        return then && later ? *later - *then : Nanoseconds{-1};
    };
    DelayGuarantee found = watched.found;
    found.at = now - began_;
    found.window = now - looked_at_;
    found.tasks = watched.told ? waited : Nanoseconds{-1};
    found.throttled = ward.throttled < 0 ? -1 : ward.throttled - watched.before.throttled;
    found.beyond = ward.beyond - watched.before.beyond;
    found.stopped = stood_still_;
    found.quota = ward.ordinary ? std::min(quota_, found.window) : Nanoseconds{0};
    const auto core = std::ranges::find(cores_, found.core, &Core::core);
    found.host = since(core->then.host, core->now.host);
    found.interrupted = since(core->then.interrupted, core->now.interrupted);
    found.interrupts = core->now.interrupts.empty() ? -1 : 0;
    std::uint64_t most = 0;
    for (const auto& [name, count] : core->now.interrupts) {
        const auto before = core->then.interrupts.find(name);
        const std::uint64_t came = count - (before == core->then.interrupts.end() ? 0 : before->second);
        found.interrupts += static_cast<std::int64_t>(came);
        if (came <= most) continue;
        most = came;
        found.most = std::string_view{name};
    }
    return found;
}

void DelayWitness::describe(GuaranteeReport& report) const {
    for (const Watched& watched : watched_) {
        if (watched.found.worst > Nanoseconds{0} && !report.delays.full())
            report.delays.push_back(watched.found);
    }
}

}  // namespace qduino::board::linux
