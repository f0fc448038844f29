#include "report/picture/recorder.h"

#include <algorithm>

#include "base/text.h"

namespace qduino::apps::picture {

std::string row_name(VcpuId id) {
    return text<std::string>(id <= sched::kMainVcpuLimit ? "loop " : "io ", id);
}

void Recorder::declare(const sched::Vcpu& vcpu, bool owns_core) {
    Row& row = at(vcpu.core, vcpu.id).row;
    static_cast<sched::Vcpu&>(row) = vcpu;
    row.owns_core = owns_core;
}

Recorder::Vcpu& Recorder::at(int core, VcpuId id) {
    const auto [found, is_new] = vcpus_.try_emplace(id);
    Row& row = found->second.row;
    if (is_new) {
        row.id = id;
        row.name = row_name(id);
        row.core = core;
        if (id > sched::kMainVcpuLimit) row.kind = sched::VcpuKind::io;
    }
    return found->second;
}

void Recorder::does(int core, VcpuId id, Doing doing, Instant now, Nanoseconds left) {
    Vcpu& vcpu = at(core, id);
    VcpuId& running = running_[core];
    if (doing == Doing::runs && running != 0 && running != id) {
        does(core, running, Doing::waits, now);
    }
    end_stretch(vcpu, now, left);
    vcpu.doing = doing;
    vcpu.since = now;
    vcpu.left = left;
    if (doing == Doing::runs) {
        running = id;
    } else if (running == id) {
        running = 0;
    }
    if (doing == Doing::nothing) vcpu.idle_since = now;
}

void Recorder::end_stretch(Vcpu& vcpu, Instant now, Nanoseconds left) {
    const Instant from = std::max(vcpu.since, from_), until = std::min(now, until_);
    if (vcpu.doing == Doing::nothing || from >= until) return;
    Stretch stretch{
        .doing = vcpu.doing, .from = from, .until = until, .left_from = vcpu.left, .left_until = left};
    if (vcpu.doing == Doing::runs && vcpu.left >= Nanoseconds{0}) {
        // Nobody told it: what it had, less what it ran.
        if (left < Nanoseconds{0})
            stretch.left_until = std::max(vcpu.left - (now - vcpu.since), Nanoseconds{0});
    }
    vcpu.row.stretches.push_back(stretch);
    if (++stretches_ < kStretchLimit || cut_) return;
    until_ = now;
    cut_ = true;
}

void Recorder::taken(int core, Instant from, Instant until, const std::string& what) {
    if (VcpuId running = running_[core]; running != 0) {
        Vcpu& vcpu = at(core, running);
        const Nanoseconds ran = std::max(from - vcpu.since, Nanoseconds{0});
        const Nanoseconds left =
            vcpu.left < Nanoseconds{0} ? kUnknown : std::max(vcpu.left - ran, Nanoseconds{0});
        end_stretch(vcpu, from, left);
        vcpu.since = std::max(vcpu.since, until);
        vcpu.left = left;
    }
    from = std::max(from, from_);
    until = std::min(until, until_);
    if (from >= until) return;
    std::vector<Taken>& all = taken_[core];
    if (!all.empty() && all.back().until == from && all.back().what == what) {
        all.back().until = until;
        return;
    }
    all.push_back({from, until, what});
    ++stretches_;
}

void Recorder::end_release(Vcpu& vcpu, std::optional<Instant> end) {
    const auto is_open = [](const Release& r) { return !r.done && !r.met.value_or(false); };
    const auto open = std::ranges::find_if(vcpu.row.releases, is_open);
    if (open == vcpu.row.releases.end() || !open->due) return;
    if (end && *end < open->at) end.reset();
    open->done = end;
    open->met = !end || *end <= *open->due;
    if (!end) return;
    std::optional<Nanoseconds>& worst = vcpu.row.worst_response;
    worst = std::max(worst.value_or(Nanoseconds{0}), *end - open->at);
}

void Recorder::released(int core, VcpuId id, Instant now, std::optional<Instant> due) {
    std::vector<Release>& releases = at(core, id).row.releases;
    const auto outside = [this](const Release& r) { return r.due.value_or(r.at) <= from_ || r.at >= until_; };
    if (!releases.empty() && (releases.back().met || !releases.back().due) && outside(releases.back()))
        releases.pop_back();
    releases.push_back({.at = now, .due = due, .done = {}, .met = {}});
}

void Recorder::ended(VcpuId id, Instant now) {
    if (const auto found = vcpus_.find(id); found != vcpus_.end()) end_release(found->second, now);
}

void Recorder::ended_in_time(VcpuId id) {
    const auto found = vcpus_.find(id);
    if (found == vcpus_.end()) return;
    end_release(found->second, found->second.idle_since);
}

void Recorder::missed(VcpuId id, Instant now) {
    const auto found = vcpus_.find(id);
    if (found == vcpus_.end()) return;
    for (Release& release : found->second.row.releases) {
        if (!release.met && release.due && *release.due <= now) release.met = false;
    }
}

Schedule Recorder::finish(Instant now) {
    until_ = std::max(std::min(until_, now), from_ + Nanoseconds{1});
    Schedule schedule;
    schedule.from = from_;
    schedule.until = until_;
    for (auto& [id, vcpu] : vcpus_) {
        end_stretch(vcpu, now, kUnknown);
        vcpu.doing = Doing::nothing;
        std::erase_if(vcpu.row.releases, [&](const Release& r) { return r.at >= until_; });
        const int number = vcpu.row.core;
        auto core = std::ranges::find(schedule.cores, number, &Core::number);
        if (core == schedule.cores.end()) {
            schedule.cores.push_back({.number = number, .rows = {}, .taken = std::move(taken_[number])});
            core = schedule.cores.end() - 1;
        }
        core->rows.push_back(std::move(vcpu.row));
    }
    for (auto& [number, taken] : taken_) {
        if (!taken.empty())
            schedule.cores.push_back({.number = number, .rows = {}, .taken = std::move(taken)});
    }
    put_in_order(schedule);
    return schedule;
}

}  // namespace qduino::apps::picture
