// The core's scheduler by its definition, one tick (1 ns) at a time: in each tick the VCPU of
// highest priority that has work and may run, runs. No event, no budget timer, no lists: every tick
// looks at everything anew.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "tests/oracle/sched/token_server.h"

namespace qduino::sched::oracle {

/// PIBS in ticks.
struct TickPibs {
    std::int64_t budget;  // of the ratio U
    std::int64_t period;
    std::int64_t eligible = 0;
    std::int64_t charged_from = 0;
    std::int64_t client = 0;
    std::int64_t remaining = 0;
    std::int64_t used = 0;

    [[nodiscard]] std::int64_t share(std::int64_t t) const {
        return std::max<std::int64_t>(budget * t / period, 1);
    }
    [[nodiscard]] std::int64_t recovery() const { return (used * period + budget - 1) / budget; }
    void open(std::int64_t now, std::int64_t client_period) {
        client = client_period;
        eligible = charged_from = std::max(eligible, now);
        remaining = share(client);
        used = 0;
    }
    void close() {
        eligible = charged_from + recovery();
        used = remaining = 0;
    }
    void raise(std::int64_t now, std::int64_t client_period) {
        if (client_period >= client) return;
        client = client_period;
        remaining = std::min(remaining, share(client));
        if (eligible > now) return;
        charged_from = std::max(now, charged_from + recovery());
        used = 0;
    }
};

struct TickVcpu {
    int id;
    bool io;
    std::int64_t period;
    TokenServer server;  // main
    TickPibs pibs;       // io
    std::int64_t work = 0;

    [[nodiscard]] std::int64_t priority() const { return io ? pibs.client : period; }
    [[nodiscard]] bool may_run(std::int64_t now) const {
        if (work == 0) return false;
        return io ? pibs.eligible <= now && pibs.remaining > 0 : server.may_run(now);
    }
};

class TickScheduler {
  public:
    void add(int id, bool io, std::int64_t budget, std::int64_t period) {
        vcpus_.push_back({id, io, period, TokenServer{budget, period, 0}, TickPibs{budget, period}});
    }
    void arrive(int id, std::int64_t now, std::int64_t work, std::int64_t client_period) {
        TickVcpu& vcpu =
            *std::find_if(vcpus_.begin(), vcpus_.end(), [id](const auto& v) { return v.id == id; });
        const bool idle = vcpu.work == 0;
        vcpu.work += work;
        if (vcpu.io && idle) vcpu.pibs.open(now, client_period);
        if (vcpu.io && !idle) vcpu.pibs.raise(now, client_period);
        if (!vcpu.io && idle) vcpu.server.wake(now);
    }
    /// Runs [now, now + 1) and returns who ran, 0 when the core idled.
    int tick(std::int64_t now) {
        TickVcpu* best = nullptr;
        for (TickVcpu& vcpu : vcpus_) {
            if (!vcpu.may_run(now)) continue;
            const bool higher = !best || vcpu.priority() < best->priority() ||
                                (vcpu.priority() == best->priority() && vcpu.id < best->id);
            if (higher) best = &vcpu;
        }
        if (!best) return 0;
        run(*best, now);
        return best->id;
    }

  private:
    static void run(TickVcpu& vcpu, std::int64_t now) {
        --vcpu.work;
        if (!vcpu.io) return vcpu.server.spend_one();
        ++vcpu.pibs.used;
        const bool exhausted = --vcpu.pibs.remaining == 0;
        if (exhausted || vcpu.work == 0) vcpu.pibs.close();
        if (exhausted && vcpu.work > 0) vcpu.pibs.open(now + 1, vcpu.pibs.client);
        // What the server sees when budget and work end together: a service opened, and closed
        // unused.
        if (exhausted && vcpu.work == 0) vcpu.pibs.eligible = std::max(vcpu.pibs.eligible, now + 1);
    }

    std::vector<TickVcpu> vcpus_;
};

}  // namespace qduino::sched::oracle
