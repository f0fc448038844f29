// The tables of the kernel, one of each: cores, threads by their VCPU's number. And how work gets
// to an I/O VCPU.
#pragma once

#include <array>

#include "board/metal/core/core.h"

namespace qduino::board::metal {

extern std::array<Core, kCoresMax> cores;
extern std::array<Thread, kVcpuLimit> threads;

/// The cores that have come up are first_core() up to core_count(). Those below are none of ours:
/// on a core that Linux gave up, they are Linux's.
[[nodiscard]] int first_core();
[[nodiscard]] int core_count();
[[nodiscard]] inline bool is_ours(int core) { return core >= first_core() && core < core_count(); }
[[nodiscard]] inline Core& core_at(int number) { return cores[static_cast<std::size_t>(number)]; }
/// The first one, which is the host's.
[[nodiscard]] inline Core& host_core() { return core_at(first_core()); }
/// The core that boots is `number`. Before any other call, where it is not 0.
void begin_with_core(int number);
/// The calling core has come up.
void count_core();

/// The core that thread `thread` is on.
[[nodiscard]] inline Core& core_of(const Thread& thread) { return core_at(thread.spec.core); }
/// The VCPU that runs here; kNoVcpu: the host does.
[[nodiscard]] inline VcpuId running_vcpu() {
    const Thread* const thread = this_core().running();
    return thread ? thread->spec.id : kNoVcpu;
}

/// Queues `work` for I/O VCPU `io`, from any core, from a thread or a top half. False when there is
/// no such VCPU that serves handlers, or its queue is full. That is counted; not of a device, whose
/// top half then serves.
bool give_work(VcpuId io, const Work& work);

/// The body of an I/O VCPU: does the work that it is given, until `ended` is true.
void serve_work(Thread& self, const std::atomic<bool>& ended);

}  // namespace qduino::board::metal
