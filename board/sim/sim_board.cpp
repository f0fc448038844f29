#include "board/sim/sim_board.h"

namespace qduino::board::sim {

Result<void> SimBoard::serve_interrupts(DeviceClass device, VcpuId io) {
    if (io != kNoVcpu && (io < kFirstIoVcpu || io >= kVcpuLimit)) {
        return make_error(ErrorCode::invalid_argument, "serve_interrupts: not the number of an I/O VCPU");
    }
    loop_.interrupts().serve(device, io);
    return {};
}

Result<void> SimBoard::change_io(VcpuId io, sched::VcpuParameters parameters) {
    Vcpu* const vcpu = loop_.cpus().vcpu(io);
    if (!vcpu || !vcpu->spec.is_io()) return make_error(ErrorCode::not_found, "there is no I/O VCPU ", io);
    vcpu->core->change_io(*vcpu, parameters, loop_.now());
    loop_.look_up();
    return {};
}

Result<void> SimBoard::route_interrupts(DeviceClass device, int core, bool allowed) {
    if (core < 0 || core >= core_count())
        return make_error(ErrorCode::invalid_argument, "route_interrupts: no such core");
    if (loop_.interrupts().route(device, core, allowed)) return {};
    return make_error(ErrorCode::unavailable,
                      "noInterrupts: no other core is left to take this device's interrupts");
}

Result<void> SimBoard::core_timer(int core, bool enabled) {
    if (core < 0 || core >= core_count())
        return make_error(ErrorCode::invalid_argument, "core_timer: no such core");
    if (!enabled && loop_.started() && !loop_.cpus().core(core).owner()) {
        return make_error(ErrorCode::not_permitted,
                          "noTimer: the core is shared; give it to one loop (budget == period) first");
    }
    loop_.interrupts().set_tick(core, enabled, loop_.now());
    loop_.look_up_at(loop_.interrupts().next());
    return {};
}

GuaranteeReport SimBoard::guarantee() const {
    GuaranteeReport report;
    report.board = "simulator";
    report.simulated = true;
    report.memory_locked = true;
    loop_.cpus().each([&](const Vcpu& vcpu) {
        LoopGuarantee loop{vcpu.spec};
        loop.priority_enforced = loop.budget_enforced = true;
        loop.core_owned = vcpu.spec.owns_core;
        report.loops.push_back(loop);
        if (!vcpu.times.empty())
            report.bottom_halves.push_back(vcpu.times.describe(vcpu.spec.id, vcpu.spec.core));
    });
    for (int core = 0; core < core_count(); ++core) {
        report.cores.push_back({.core = core,
                                .interrupts_per_second = loop_.interrupts().rate_hz(core),
                                .worst_gap = Nanoseconds{-1},
                                .tick_stopped = !loop_.interrupts().ticks(core),
                                .throttling_lifted = true,
                                .note = "virtual time"});
    }
    return report;
}

/// Random arrivals have no least distance. They are counted at twice their rate, and a burst before
/// that: in any window of any length there are more of them with a probability below e^(−θ·burst),
/// where e^θ − 1 = 2θ, θ = 1.256 (Lundberg's inequality; F. Lundberg 1903, H. Cramér 1930): 1e−9.
constexpr double kPoissonMargin = 2;
constexpr int kPoissonBurst = 17;

sched::PlatformOverheads SimBoard::platform_overheads(int core) {
    sched::PlatformOverheads overheads;
    // To it, and back to what it preempted.
    overheads.release_cost = overheads.wait_cost = 2 * config_.costs.context_switch;
    overheads.wake_latency = config_.wake_latency;
    overheads.victim_pays = config_.charge_interrupts_to_victim;
    for (const InterruptSource& source : loop_.interrupts().on_core(core)) {
        Nanoseconds cost = source.top_half;
        const bool tick = source.device == DeviceClass::all;
        if (!tick && loop_.interrupts().server_of(source.device) == kNoVcpu) cost += source.bottom_half;
        if (cost <= Nanoseconds{0}) continue;
        const bool random = !tick && source.arrival == Arrival::poisson;
        const Nanoseconds interval = from_seconds(1.0 / source.rate_hz / (random ? kPoissonMargin : 1));
        overheads.add({.name = tick ? "tick" : "interrupts",
                       .cost = cost,
                       .interval = interval,
                       .jitter = random ? kPoissonBurst * interval : Nanoseconds{0},
                       .source = static_cast<int>(source.device)});
    }
    return overheads;
}

}  // namespace qduino::board::sim
