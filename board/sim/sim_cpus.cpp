#include "board/sim/sim_cpus.h"

#include <algorithm>

#include "base/contract.h"
#include "board/vcpu_check.h"

namespace qduino::board::sim {

SimCpus::SimCpus(EventLoop& loop, const SimConfig& config) : loop_(loop), config_(config) {
    QDUINO_EXPECT(config.cores >= 1 && config.cores <= 64);
    for (int core = 0; core < config.cores; ++core)
        cores_.push_back(std::make_unique<SimCore>(loop, config, core));
}

Result<void> SimCpus::start(std::span<const VcpuSpec> specs, Instant now, void (*entry)(void* vcpu)) {
    for (const VcpuSpec& spec : specs) {
        if (spec.core < 0 || spec.core >= core_count())
            return make_error(ErrorCode::not_found, "a VCPU asks for a core that is not there");
        QDUINO_TRY(check_vcpu(spec, specs));
    }
    for (const VcpuSpec& spec : specs) {
        if (vcpus_[spec.id]) return make_error(ErrorCode::already_exists, "start: two VCPUs of one number");
        auto vcpu = std::make_unique<Vcpu>();
        vcpu->spec = spec;
        vcpu->loop = &loop_;
        vcpu->wake = spec.entry ? now : kForever;
        vcpu->has_fault = std::any_of(config_.loop_faults.begin(), config_.loop_faults.end(),
                                      [&](const LoopFault& fault) { return fault.loop == spec.id; });
        if (!spec.entry) vcpu->queue = std::make_unique<WorkQueue>();
        vcpu->fiber = std::make_unique<Fiber>(entry, vcpu.get(), config_.stack_bytes);
        if (!core(spec.core).add(*vcpu, now)) {
            return make_error(ErrorCode::invalid_argument,
                              "a VCPU needs 0 < budget <= period, and a number of its own");
        }
        vcpus_[spec.id] = std::move(vcpu);
        if (!spec.is_io()) ++unfinished_;
    }
    return {};
}

Instant SimCpus::next_due() const {
    Instant next = kForever;
    for (const auto& core : cores_) next = std::min(next, core->next_due());
    return next;
}

void SimCpus::settle(Instant now) {
    for (const auto& core : cores_) {
        if (core->next_due() <= now) core->settle(now);
    }
}

SimCore* SimCpus::ready_core() const {
    for (const auto& core : cores_) {
        if (core->ready()) return core.get();
    }
    return nullptr;
}

Instant SimCpus::others_due(const SimCore& core, Instant now) const {
    Instant next = kForever;
    for (const auto& other : cores_) {
        if (other.get() != &core) next = std::min(next, other->ready() ? now : other->next_due());
    }
    return next;
}

}  // namespace qduino::board::sim
