// What the warden has found, as lines of the guarantee.
#pragma once

#include <span>
#include <string_view>

#include "board/guarantee.h"
#include "board/linux/loop/vcpu_thread.h"
#include "board/linux/loop/warden.h"

namespace qduino::board::linux {

/// Fills in what `loop`, whose thread keeps itself to a budget, used, and whether it kept to it.
/// `shortfall`: why there is no warden, or why it does not watch. `taken`: what the host and
/// interrupts took of the loop's core since it began, as far as the kernel tells.
void describe_budget(LoopGuarantee& loop, const VcpuThread& thread, const Warden& warden,
                     std::string_view shortfall, Nanoseconds taken);

/// Fills in what the kernel threads of `loop`, an I/O VCPU, used of its budget; nothing where it
/// has none.
void describe_kernel_threads(LoopGuarantee& loop, std::span<const KernelThread> threads,
                             const Warden& warden);

/// What the watch has cost, and what it found besides the loops.
void describe_watch(GuaranteeReport& report, const Warden& warden);

}  // namespace qduino::board::linux
