#include "report/schedule_trace.h"

#include "base/contract.h"
#include "report/plan_picture.h"

namespace qduino::apps {

using board::sim::TraceEvent;
using board::sim::TraceKind;
using picture::Doing;

void ScheduleTrace::follow(const runtime::Runtime& runtime, Instant from, Instant until) {
    runtime_ = &runtime;
    recorder_.emplace(from, until);
    declare_rows(runtime.plan(), *recorder_);
}

picture::Schedule ScheduleTrace::finish(Instant now) {
    QDUINO_EXPECT(recorder_.has_value());
    picture::Schedule schedule = recorder_->finish(now);
    recorder_.reset();
    return schedule;
}

void ScheduleTrace::on_event(const TraceEvent& event) {
    if (!recorder_) return;
    const auto [now, core, vcpu, kind] = event;
    const auto does = [&](Doing doing) {
        const Nanoseconds left = left_ == Nanoseconds::max() ? picture::kUnknown : left_;
        recorder_->does(event.core, event.vcpu, doing, event.time, left);
    };
    switch (kind) {
        case TraceKind::run:
            causes_[core] = {now, "switch"};
            return does(Doing::runs);
        case TraceKind::preempt:
            return does(Doing::waits);
        case TraceKind::throttle:
            return does(Doing::throttled);
        case TraceKind::replenish:
            if (recorder_->doing(vcpu) == Doing::throttled) does(Doing::waits);
            return;
        case TraceKind::block:
        case TraceKind::finish:
            return does(Doing::nothing);
        case TraceKind::release:
            return released(event);
        case TraceKind::overrun:
            return recorder_->ended(vcpu, now);
        case TraceKind::interrupt:
            causes_[core] = {now, std::string(board::sim::interrupt_name(vcpu))};
            return;
    }
}

/// The event comes when the release's code goes on; its place is its nominal start, which the
/// loop's clock knows.
void ScheduleTrace::released(const TraceEvent& event) {
    const runtime::Loop* const loop = runtime_->loop(event.vcpu);
    if (!loop) return recorder_->released(event.core, event.vcpu, event.time, std::nullopt);
    recorder_->ended_in_time(event.vcpu);
    const Instant nominal = loop->clock.nominal();
    recorder_->released(event.core, event.vcpu, nominal, nominal + loop->declaration.period);
}

void ScheduleTrace::on_ready(Instant now, int core, board::VcpuId vcpu) {
    if (recorder_) recorder_->does(core, vcpu, Doing::waits, now);
}

void ScheduleTrace::on_taken(Instant now, int core, Instant from, Instant until) {
    if (!recorder_) return;
    const Cause& cause = causes_[core];
    recorder_->taken(core, from, until, cause.at == now ? cause.what : "edge");
}

}  // namespace qduino::apps
