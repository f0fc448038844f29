// What a process tree's VCPU promises, and what the tree has used of it, for people and programs.
#pragma once

#include <string>

#include "board/guarantee.h"
#include "board/linux/kernel/cpu_group.h"
#include "vcpu/process_vcpu.h"

namespace qduino::apps {

/// The line of the guarantee report.
[[nodiscard]] board::TreeGuarantee guarantee_of(const ProcessVcpu& vcpu);

/// "412 ms of CPU time in 4.1 s, 10.0 % of a core, of 10.0 % promised; throttled in 41 of 42
/// periods".
[[nodiscard]] std::string use_text(const board::linux::TreeVcpu& tree, const board::linux::CpuGroupUse& use,
                                   Nanoseconds lasted);

/// The tree's guarantee as tree_json() gives it, and "enforced_by" (null: nothing), "used_us",
/// "lasted_us", "used_share" (of a core, since `before`), "periods", "throttled", "throttled_us".
[[nodiscard]] std::string vcpu_json(const board::TreeGuarantee& guarantee, const char* enforced_by,
                                    const board::linux::CpuGroupUse& use, Nanoseconds lasted,
                                    double used_share);

/// `used` of `lasted`; 0 for no time.
[[nodiscard]] double share_of(Nanoseconds used, Nanoseconds lasted);

}  // namespace qduino::apps
