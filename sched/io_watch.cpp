#include "sched/io_watch.h"

#include <algorithm>

namespace qduino::sched {

IoWatch::IoWatch(VcpuParameters io, Nanoseconds client_period, Nanoseconds look_every, Instant now,
                 Nanoseconds cpu)
    : server_(io, now, {}, client_period),
      look_every_(look_every),
      started_at_(now),
      looked_at_(now),
      cpu_(cpu) {}

/// As if it had run in one piece, just before: a replenishment then comes late, never early.
void IoWatch::charge(Instant now, Nanoseconds cpu) {
    now = std::max(now, looked_at_);
    const Nanoseconds used = std::max(cpu - cpu_, Nanoseconds{0});
    if (used > Nanoseconds{0}) {
        server_.activate(std::max(looked_at_, now - used), server_.usual_client());
        server_.consume(now, used);
    } else {
        server_.block(now);
    }
    cpu_ = std::max(cpu, cpu_);
    looked_at_ = now;
}

IoWatch::Verdict IoWatch::look(Instant now, Nanoseconds cpu) {
    if (held_) {
        cpu_ = std::max(cpu, cpu_);  // nobody's
        looked_at_ = std::max(now, looked_at_);
        held_ = server_.next_replenishment() > looked_at_;
    } else {
        charge(now, cpu);
        held_ = !server_.blocked() && server_.next_replenishment() > looked_at_;
        if (held_) ++holds_;
    }
    return held_ ? Verdict::hold : Verdict::run;
}

void IoWatch::held(Instant now, Nanoseconds cpu) {
    if (cpu > cpu_) charge(now, cpu);
    looked_at_ = std::max(looked_at_, now);
}

void IoWatch::change(Instant now, Nanoseconds cpu, VcpuParameters io) {
    look(now, cpu);
    server_.change(looked_at_, io);
}

Instant IoWatch::next_look() const {
    const Instant soon = looked_at_ + look_every_;
    return held_ ? std::max(server_.next_replenishment(), soon) : soon;
}

}  // namespace qduino::sched
