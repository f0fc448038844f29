#include "board/linux/delay_witness.h"

#include <unistd.h>

#include <algorithm>
#include <utility>

namespace qduino::board::linux {

void DelayWitness::begin(Instant now, const std::vector<Ward>& wards) {
    began_ = looked_at_ = now;
    for (const Ward& ward : wards) {
        if (std::ranges::count(cores_, ward.core, &Core::core) == 0)
            cores_.push_back({ward.core, core_times(ward.core, root_), {}});
        Watched& watched = watched_.emplace_back();
        watched.found.id = ward.id;
        watched.found.core = ward.core;
        watched.found.owns_core = ward.owns_core;
        watched.told = watched.times.open(::getpid(), ward.tid) && watched.times.read(watched.then);
    }
}

void DelayWitness::look(Instant now, const std::vector<Ward>& wards) {
    for (Core& core : cores_) core.now = core_times(core.core, root_);
    for (std::size_t i = 0; i < std::min(wards.size(), watched_.size()); ++i) {
        Watched& watched = watched_[i];
        sched::ThreadTimes times = watched.then;
        watched.told = watched.told && watched.times.read(times);
        if (wards[i].worst > watched.found.worst) {
            watched.found.worst = wards[i].worst;
            judge(watched, now, times.delayed - watched.then.delayed);
        }
        watched.then = times;
    }
    for (Core& core : cores_) core.then = std::move(core.now);
    looked_at_ = now;
}

/// Notes what the kernel has counted since the last look.
void DelayWitness::judge(Watched& watched, Instant now, Nanoseconds waited) const {
    DelayGuarantee& found = watched.found;
    found.at = now - began_;
    found.window = now - looked_at_;
    found.tasks = watched.told ? waited : Nanoseconds{-1};
    const auto core = std::ranges::find(cores_, found.core, &Core::core);
    found.host = core->then.host && core->now.host ? *core->now.host - *core->then.host : Nanoseconds{-1};
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
}

void DelayWitness::describe(GuaranteeReport& report) const {
    for (const Watched& watched : watched_) {
        if (watched.found.worst > Nanoseconds{0} && !report.delays.full())
            report.delays.push_back(watched.found);
    }
}

}  // namespace qduino::board::linux
