#include "apps/port/port_vcpu.h"

#include <utility>

#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/importance.h"
#include "board/linux/kernel/real_time_thread.h"

namespace qduino::port {

using board::linux::monotonic_now;
using board::linux::thread_cpu_time;
using printer::link::PortPlace;

void PortVcpu::follow(const printer::link::PortVcpu* published) {
    const PortPlace place = published != nullptr ? published->place() : PortPlace{};
    if (place == place_) return;
    place_ = place;
    server_.reset();
    importance::step_down();
    if (place.priority == 0) return;
    const sched::VcpuParameters parameters{place.budget, place.period};
    if (!parameters.valid() || place.client <= Nanoseconds{0}) return;
    static_cast<void>(board::linux::pin_to_core(place.core));
    importance::rise(place.priority);
    // What it took to get here (memory is locked, so all of it is made) is not a turn's.
    server_.emplace(parameters, monotonic_now(), Nanoseconds{}, place.client);
    server_->activate(monotonic_now(), place.client);
    cpu_ = thread_cpu_time();
}

void PortVcpu::begin() {
    if (!server_) return;
    server_->activate(monotonic_now(), place_.client);
    while (!server_->eligible(monotonic_now())) board::linux::block_until(server_->next_replenishment());
}

void PortVcpu::end() {
    if (!server_) return;
    const Nanoseconds cpu = thread_cpu_time();
    const Instant now = monotonic_now();
    static_cast<void>(server_->consume(now, cpu - std::exchange(cpu_, cpu)));
    server_->block(now);
}

Nanoseconds PortVcpu::recovery_of(Nanoseconds used) const {
    return server_ ? server_->recovery_of(used) : Nanoseconds{};
}

}  // namespace qduino::port
